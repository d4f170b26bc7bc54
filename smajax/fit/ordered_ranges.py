"""Fits that end with a transformation which would finish before it starts, brought into order.

The kinetics takes a reversed range as the narrowest one, at its lower end as it is named (A_s on heating, M_f on cooling). The other end changes
nothing there: a descent that comes there does not come back, and an end that the runs do not determine stays where its start was drawn.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import total_costs
from smajax.fit.problem import FitTask, Problem
from smajax.model.wire.kinetics import NARROWEST_RANGE
from smajax.model.wire.order import RANGES

ROOM = 5.0  # K: about the narrowest range of a wire
SAME = 1e-7  # relative: two costs of one simulation, added up in different orders


def _places(problem: Problem) -> list[tuple[int, int]]:
    """(lower, higher) of each range that the problem has, as places in its parameters."""
    names = problem.names
    return [(names.index(low), names.index(high)) for low, high, _ in RANGES if low in names and high in names]


def _reversed(problem: Problem, values: np.ndarray) -> list[tuple[int, int]]:
    return [(low, high) for low, high in _places(problem) if values[low] >= values[high]]


def _stuck(problem: Problem, values: np.ndarray) -> bool:
    """Whether a range is reversed, or so narrow that its higher end changes nothing either: a descent does not leave it."""
    return any(values[high] - values[low] < NARROWEST_RANGE for low, high in _places(problem))


def _exchanged(problem: Problem, task: FitTask, values: np.ndarray) -> np.ndarray:
    """`values` (P,) with reversed ranges in order, `ROOM` wide or more as far as the bounds allow."""
    found, places = np.array(values), task.slots.tolist()
    bounds: dict[int, tuple[float, float]] = dict(
        zip(places, zip(task.low.tolist(), task.high.tolist(), strict=True), strict=True)
    )
    for low, high in _places(problem):
        if values[high] - values[low] >= NARROWEST_RANGE:
            continue
        if low in bounds and high in bounds and values[low] > values[high]:
            found[low], found[high] = np.clip(values[high], *bounds[low]), np.clip(values[low], *bounds[high])
        if low in bounds:
            found[low] = np.clip(min(found[low], found[high] - ROOM), *bounds[low])
        if high in bounds:
            found[high] = np.clip(max(found[high], found[low] + ROOM), *bounds[high])
    return found


def _narrow(problem: Problem, task: FitTask, values: np.ndarray) -> np.ndarray:
    """`values` (P,) with the higher end of reversed ranges just above the lower, where the model is the same."""
    found = np.array(values)
    for low, high in _reversed(problem, values):
        if high in task.slots:
            found[high] = values[low] + 0.5 * NARROWEST_RANGE
    found[task.slots] = np.clip(found[task.slots], task.low, task.high)
    return found


def in_order(
    problem: Problem, tasks: Sequence[FitTask], fits: Sequence[Fit], settings: FitSettings | None = None
) -> list[Fit]:
    """`fits` of these tasks, in which all runs count alike; each that ends with a reversed range, or with one of no width, once more from ends in order.

    The better of the two is taken, as a range of next to no width where it is the reversed one. One whose bounds, or whose given
    values, allow no order stays reversed.
    """
    wrong = [k for k, fit in enumerate(fits) if _stuck(problem, fit.values)]
    if not wrong:
        return list(fits)
    settings = dataclasses.replace(settings or FitSettings(), stage="fitting with ranges in order")
    again = levenberg_marquardt(
        problem,
        [tasks[k]._replace(values=_exchanged(problem, tasks[k], fits[k].values)) for k in wrong],
        settings,
    )
    found = list(fits)
    for k, other in zip(wrong, again, strict=True):
        points = [_narrow(problem, tasks[k], one.values) for one in (fits[k], other)]
        ordered = [
            dataclasses.replace(one, values=point, cost=float(cost))
            for one, point, cost in zip((fits[k], other), points, total_costs(problem, points), strict=True)
            if not _reversed(problem, point)
        ]
        best = min(ordered, key=lambda one: one.cost, default=fits[k])
        if best.cost <= fits[k].cost * (1.0 + SAME):
            steps = fits[k].steps + (other.steps if best.values is points[1] else 0)
            found[k] = dataclasses.replace(best, steps=steps)
    return found
