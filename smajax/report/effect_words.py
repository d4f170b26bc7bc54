"""What the fitted coefficients of an effect say beyond that it is there."""

from __future__ import annotations

from collections.abc import Mapping

from smajax.core.display_units import digits, with_error
from smajax.model.effects.input_delay import InputDelay
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.pulley_stribeck_friction import PulleyStribeckFriction
from smajax.model.effects.stribeck_friction import StribeckFriction

NO_FALL = 1e-3  # of a ratio of frictions without a standard error: nearer to 1 it ends there
Fitted = Mapping[str, tuple[float, float | None]]  # coefficient -> (value, standard error), SI


def meaning(effect: str, fitted: Fitted) -> str:
    """What the presence of an effect means, in a sentence; of friction that does not fall with the speed that it is the plain one."""
    ratio = fitted.get("sliding")
    if effect in (StribeckFriction.effect_name, PulleyStribeckFriction.effect_name) and ratio is not None:
        value, error = ratio
        if 1.0 - value <= (NO_FALL if error is None else error):
            grows = ", which grows with the load" if effect == PulleyStribeckFriction.effect_name else ""
            return (
                f"The friction in motion is as large as at rest (their ratio, sliding, is {with_error(value, error)}): this is plain Coulomb "
                f"friction{grows}, and the speed about which it would fall means nothing."
            )
    candidate = LIBRARY[effect].candidate
    switches = [fitted[name][0] for name in candidate.switches if name in fitted]
    if candidate.negative_sentence and switches and max(switches) < 0.0:
        return candidate.negative_sentence
    return candidate.sentence


def sign_sentences(effect: str, fitted: Fitted) -> tuple[str, ...]:
    """That a delay which ends below zero is none."""
    delay = fitted.get("delay")
    if effect != InputDelay.effect_name or delay is None or not delay[0] < 0.0:
        return ()
    early = f"{digits(-1e3 * delay[0], 3)} ms"
    return (
        f"The delay is negative: what the log has of the input acted {early} before the time that it has there. The clock of the command is late by "
        "that, or that of the sensor early.",
    )
