"""What a tuning comes to, first of all: in one sentence, and in a row a set point."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from smajax.control.tune.terms import TERMS, terms_in
from smajax.control.tune.tuning import Check, TuningResult
from smajax.core.display_units import digits
from smajax.core.wording import and_listed, counted

COLUMNS = list(TERMS)
TUNED = 1  # of two candidates: the tuned gains
NOTHING = 1e-6  # of a degree or a millimetre: a rounding error
SEVERAL = 4  # set points that the sentence names one by one


def _column(result: TuningResult, check: Check, name: str) -> np.ndarray:
    """A term of every loop with the tuned gains, (loops,), in the unit shown; infinite where it never settles."""
    values = check.seen.exact[TUNED, :, COLUMNS.index(name)]
    never = 2.0 * result.settings.seconds if name == "settling_time" else np.inf
    return np.where(values >= never, np.inf, values)


def met(result: TuningResult, check: Check) -> np.ndarray:
    """(loops,): whether each settles and keeps every limit."""
    good = np.isfinite(_column(result, check, "settling_time"))
    for name, limit in result.settings.limits.items():
        good &= _column(result, check, name) <= limit
    return good


def _shown(value: float, unit: str, count: int = 3) -> str:
    return "never" if np.isinf(value) else f"{digits(0.0 if abs(value) < NOTHING else value, count)} {unit}"


def answer(result: TuningResult) -> str:
    """Whether the tuned gains reach every set point, how soon, with what overshoot and steady error, and on which share of the plants."""
    settings, check = result.settings, result.checks["tuned on"]
    good, times = met(result, check), _column(result, check, "settling_time")
    symbol, targets = settings.shown.symbol, np.unique(check.scenarios.targets)
    places = {float(settings.shown.of(one)): times[check.scenarios.targets == one] for one in targets}
    worst = {point: float(here.max()) for point, here in places.items()}
    nowhere = {point for point, here in places.items() if not np.isfinite(here).any()}
    what = "settle and keep every limit" if settings.limits else "settle"
    many = (
        "the loop"
        if good.size == 1 and good.all()
        else f"all {good.size} loops"
        if good.all()
        else f"{int(good.sum()) or 'none'} of {counted(good.size, 'loop')}"
    )
    sentence = f"The tuned gains of {settings.controller} {what} in {many}{_when(worst, nowhere, symbol)}"
    unit = terms_in(settings.shown)["overshoot"].unit
    errors = [_shown(float(_column(result, check, name).max()), unit, 2) for name in ("overshoot", "steady_error")]
    sentence += f"; the overshoot is at most {errors[0]}, the steady error at most {errors[1]}."
    unseen = met(result, result.checks["inside"])
    new = "plants and set points" if settings.variation or settings.batch else "set points"
    return f"{sentence} On {new} never seen they do in {int(unseen.sum()) or 'none'} of {unseen.size}."


def _when(worst: Mapping[float, float], nowhere: Collection[float], symbol: str) -> str:
    """`, at 5 mm after 2.1 s and at 10 mm after 3 s at the latest`, or from the soonest to the latest of many.

    worst: the latest time of each set point, s; infinite where a plant never settles. nowhere: the set points where none does.
    """
    if len(worst) > SEVERAL:
        settled = {point: late for point, late in worst.items() if np.isfinite(late)}
        never = [f"{point:.4g}{symbol}" for point in worst if point in nowhere]
        partly = [f"{point:.4g}{symbol}" for point in worst if point not in settled and point not in nowhere]
        if not settled:
            return ""
        last = max(settled, key=lambda point: settled[point])
        return f", after {digits(settled[last], 3)} s at the latest (at {last:.4g}{symbol})" + (
            (f"; not on every plant at {and_listed(partly)}" if partly else "")
            + (f"; on no plant at {and_listed(never)}" if never else "")
        )
    each = [
        f"at {point:.4g}{symbol} "
        + (
            f"after {digits(late, 3)} s"
            if np.isfinite(late)
            else "on no plant"
            if point in nowhere
            else "not on every plant"
        )
        for point, late in worst.items()
    ]
    return f", {and_listed(each)} at the latest" if all(np.isfinite(list(worst.values()))) else f", {and_listed(each)}"


def set_point_rows(result: TuningResult) -> tuple[list[str], list[list[str]]]:
    """(head, rows): a row a set point that was tuned on, with the tuned gains: share of plants, settling time, overshoot, steady error."""
    settings, check = result.settings, result.checks["tuned on"]
    unit, targets, good = settings.shown, check.scenarios.targets, met(result, check)
    length = terms_in(unit)["overshoot"].unit
    head = [
        f"set point ({unit.label})",
        "plants that settle" + " within the limits" * bool(settings.limits),
        "settling time, median (s)",
        "worst (s)",
        f"overshoot, worst ({length})",
        f"steady error, worst ({length})",
    ]
    rows = []
    for target in np.unique(targets):
        here = targets == target
        times = _column(result, check, "settling_time")[here]
        worst = [float(_column(result, check, name)[here].max()) for name in ("overshoot", "steady_error")]
        rows.append(
            [
                f"{float(unit.of(target)):.4g}",
                f"{int(good[here].sum())} of {int(here.sum())}",
                *(_shown(float(of(times)), "").strip() for of in (np.median, np.max)),
                *(_shown(one, "").strip() for one in worst),
            ]
        )
    return head, rows
