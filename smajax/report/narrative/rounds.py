"""Why a round of the search ended so."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from smajax.attribution.findings import Round
from smajax.attribution.reasons import (
    HeldOutWorse,
    LikelierModel,
    NoiseWithoutEffects,
    NoiseWithoutRun,
    NoLikelierModel,
    PredictsTooLittle,
    Reason,
    StepDependent,
    UnknownTermLikelier,
)
from smajax.report.narrative.values import log_odds_text, value_text


def chosen_text(entry: Round) -> str:
    """`latent_heat + radiation`, `without creep`, or nothing."""
    return f"without {entry.chosen}" if entry.removed else entry.chosen


def reason_text(reason: Reason, unit: str, quantity: str, most: int | None = None) -> str:
    """`unit` (SI) and `quantity` of the output. `most`: sets of effects that are listed, the likeliest; None: all in the order of the fits."""

    def error(value: float) -> str:
        return value_text(value, unit, quantity)

    match reason:
        case StepDependent(effects, kept):
            return f"{effects} keeps {max(kept, 0.0):.0%} of its gain at half the step and is not accepted"
        case LikelierModel(before, log_odds, compared):
            return f"likelier than {before or 'the base model'} by {log_odds_text(log_odds)}; {_compared(compared, error, most)}"
        case NoLikelierModel(compared):
            return f"no other set of effects is likelier; {_compared(compared, error, most)}"
        case PredictsTooLittle(share, least):
            return (
                f"set aside: with it the model explains {share:.0%} of the motion in runs left out, and under {least:.0%} "
                "an effect means nothing"
            )
        case NoiseWithoutEffects(log_odds):
            return f"set aside: what is left without it is noise as well, and the model found is {'likelier' if log_odds >= 0.0 else 'less likely'} by {log_odds_text(log_odds)} only"
        case NoiseWithoutRun(run):
            return f"set aside: without {run} what the base model leaves is noise"
        case UnknownTermLikelier(title, log_odds):
            return f"set aside: {title} alone is likelier than all of them by {log_odds_text(log_odds)}"
        case HeldOutWorse(without, with_it):
            return f"set aside: error on the held-out runs {error(without)} without and {error(with_it)} with it"


def _compared(compared: Sequence[tuple[str, float, float]], error: Callable[[float], str], most: int | None) -> str:
    """`fitted: latent_heat (+812.0, error 0.05 mm), ...`; log odds are over the model before."""
    if not compared:
        return "none was worth a fit"
    listed = compared if most is None else sorted(compared, key=lambda one: -one[1])[:most]
    parts = [f"{effects or 'the base model'} ({odds:+.1f}, error {error(rms)})" for effects, odds, rms in listed]
    left = len(compared) - len(listed)
    return f"fitted: {', '.join(parts)}{f' and {left} less likely ones' if left else ''}"
