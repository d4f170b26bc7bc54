"""A transformation that lags behind the temperature: the faster the wire is heated, the higher its range seems."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import DELAY, Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import DURATION, HistoryTerm, following
from smajax.model.wire.kinetics import cooling_width, heating_width
from smajax.model.wire.kinetics_terms import RangeTerm
from smajax.model.wire.wire import Kinetics

LAGGING = "lagging_temperature"
LAGGING_STRESS = "lagging_stress"


def _apart(slope: Scalar, at: tuple[Scalar, Scalar], other: tuple[Scalar, Scalar]) -> Scalar:
    """y of one (temperature, stress) less that of another, C."""
    return at[0] - other[0] - (at[1] - other[1]) / slope


class LaggingTransformation(AbstractEffect, HistoryTerm, RangeTerm):
    r"""$\tau \dot T_k + T_k = T$ and $\tau \dot\sigma_k + \sigma_k = \sigma$, with T_k and sigma_k in both curves.

    The phases follow what drives them, $y = T - \sigma/C$, a time constant late. At a steady rate the ranges are shifted by
    $\tau \dot y$: up on heating, down on cooling. The late values are carried from step to step, solved together with
    everything else.
    """

    time_constant: Scalar = parameter("s", 0.0, 20.0, "tau", default=0.0)

    effect_name: ClassVar[str] = "lagging_transformation"
    candidate: ClassVar[Candidate] = Candidate(
        title="transformation that depends on the rate",
        equation="kinetics",
        formula="tau dT_k/dt + T_k = T, likewise sigma_k, in the place of T and sigma in eq. 3.3 and 3.5 (a lag of first order)",
        sentence="The phases take time to change: when heated or cooled quickly the wire transforms at a higher (lower) "
        "temperature, and goes on for a moment when the temperature stands still.",
        switches=("time_constant",),
        initial_guess={"time_constant": 0.1},
        needs_time=True,
        similar_group=DELAY,
        prior_class="bench",
        widths={
            "time_constant": Width(
                0.2,
                "the transformation itself is as quick as sound; gradients of temperature in the wire and its grips: up to tenths of a second",
            ),
        },
    )

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {LAGGING: at.temperature, LAGGING_STRESS: at.stress, DURATION: jnp.zeros_like(at.temperature)}

    def _late(self, temperature: Scalar, stress: Scalar, old: WireState) -> tuple[Scalar, Scalar]:
        """Both late values at the end of a step from `old`."""
        return (
            following(old, LAGGING, old.temperature, temperature, self.time_constant),
            following(old, LAGGING_STRESS, old.stress, stress, self.time_constant),
        )

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        late_temperature, late_stress = self._late(new.temperature, new.stress, old)
        return {LAGGING: late_temperature, LAGGING_STRESS: late_stress}

    def turn_within(self, law: Kinetics, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        r"""Where the late y meets y, which has turned: $t = \tau \ln[1 - b/(\tau \dot y)]$ with b what it is behind by at the start of the step; 0 where it does not."""
        lasts, tau = old.history[DURATION], self.time_constant + 1e-15
        start, late = (old.temperature, old.stress), (old.history[LAGGING], old.history[LAGGING_STRESS])
        heats = _apart(law.stress_slope_austenite, start, late) > 0.0
        slope = jnp.where(heats, law.stress_slope_austenite, law.stress_slope_martensite)
        behind, change = _apart(slope, start, late), _apart(slope, (temperature, stress), start)
        turns = behind * change < 0.0
        ratio = jnp.where(turns, -behind, 0.0) / jnp.where(turns, change * tau / lasts, 1.0)
        return tau / lasts * jnp.log1p(ratio)

    def _behind(self, slope: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        """How far y is behind, C."""
        return _apart(slope, self._late(temperature, stress, old), (temperature, stress))

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z + self._behind(law.stress_slope_austenite, temperature, stress, old) / heating_width(law)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z + self._behind(law.stress_slope_martensite, temperature, stress, old) / cooling_width(law)
