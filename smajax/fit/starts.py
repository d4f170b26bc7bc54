"""Where fits start: the best of many points within the bounds, so that no fit ends in the first local minimum it meets."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.core.progress import Stage
from smajax.core.result_cache import ResultCache
from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.ordered_ranges import in_order
from smajax.fit.outputs_of_runs import total_costs
from smajax.fit.problem import FitTask, Problem

MARGIN = 0.02  # share of the range that starts keep from its bounds
SCREENED = 64  # points at which the model is only simulated
STARTED = 8  # fits that are started
FIRST_STEPS = 6  # steps, before the worse ones are dropped
FINISHED = 4  # fits that are run until they end
PERTURBATION = 0.02  # of the range: how far from its end a fit is restarted
RESTARTS = 4  # a power of two, for Sobol's points


def box_points(start: np.ndarray, columns: Sequence[int], box: np.ndarray, count: int, seed: int) -> np.ndarray:
    """`start` (P,) with its `columns` at Sobol points of `box` (C, 2): shape (count, P)."""
    sobol = scipy.stats.qmc.Sobol(len(columns), seed=seed).random(count)
    points = np.tile(start, (count, 1))
    points[:, columns] = box[:, 0] + (MARGIN + (1.0 - 2.0 * MARGIN) * sobol) * (box[:, 1] - box[:, 0])
    return points


def logarithmic_points(ranges: Mapping[str, tuple[float, float]], count: int) -> list[dict[str, float]]:
    """Sobol points of positive ranges by name, by their logarithm; `count` a power of two."""
    low, high = np.log(np.asarray(list(ranges.values()))).T
    shares = scipy.stats.qmc.Sobol(len(ranges), seed=0).random(count)
    return [dict(zip(ranges, np.exp(low + share * (high - low)).tolist(), strict=True)) for share in shares]


def nearest(
    problem: Problem, groups: Sequence[Sequence[np.ndarray]], index: np.ndarray | None = None
) -> list[np.ndarray]:
    """Of each group of points the one that is nearest to the runs. `index`: of the problem's parameters in a point; None: all."""
    every = np.stack([point for group in groups for point in group])
    costs = np.nan_to_num(total_costs(problem, every if index is None else every[:, index]), nan=np.inf)
    ends = np.cumsum([len(group) for group in groups])[:-1]
    return [group[int(np.argmin(own))] for group, own in zip(groups, np.split(costs, ends), strict=True)]


def _costs(problem: Problem, points: np.ndarray, cache: ResultCache) -> np.ndarray:
    """Sum of squares at every point; infinite where the model gives no number."""
    key = cache.key(problem, "costs", points)
    cached = cache.load(key)
    if cached is not None:
        return cached["cost"]
    cost = np.nan_to_num(total_costs(problem, points), nan=np.inf)
    cache.save(key, {"cost": cost})
    return cost


def perturbed_restarts(
    problem: Problem, tasks: Sequence[FitTask], ended: Sequence[Fit], settings: FitSettings | None = None
) -> list[Fit]:
    """Every fit once more from `RESTARTS` points around its end, the best of them all.

    Where a run just meets the start of a branch, or just does not, the cost has a local minimum on either side of that;
    they lie a hundredth of the range apart, and no fit goes from one to the other.
    """
    settings = settings or FitSettings(stage="fitting from nearby")
    restarts, owner = [], []
    for k, (task, fit) in enumerate(zip(tasks, ended, strict=True)):
        if not len(task.slots):
            continue
        y = (fit.values[task.slots] - task.low) / (task.high - task.low)
        offsets = PERTURBATION * (2.0 * scipy.stats.qmc.Sobol(len(task.slots), seed=k).random(RESTARTS) - 1.0)
        restarts += [task._replace(values=task.values_at(np.clip(y + offset, 0.0, 1.0))) for offset in offsets]
        owner += [k] * RESTARTS
    best = list(ended)
    again = levenberg_marquardt(problem, restarts, dataclasses.replace(settings, max_steps=FitSettings.max_steps))
    for k, fit in zip(owner, again, strict=True):
        if fit.cost < best[k].cost:
            best[k] = dataclasses.replace(fit, steps=fit.steps + ended[k].steps)
    return best


def multistart(
    problem: Problem,
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    seed: int,
    screened: int = SCREENED,
    settings: FitSettings | None = None,
) -> list[Fit]:
    """Fits of `names`, best first: the best of `screened` points are started, and the best of those run until they end.

    The settings' `max_steps` holds for the latter.
    """
    settings = settings or FitSettings()
    start = problem.start_values()
    points = [start]
    if screened and names:
        box = np.asarray([bounds[name] for name in names])
        drawn = box_points(start, [problem.names.index(name) for name in names], box, screened, seed)
        screening = f"simulating at {screened} points of the box"
        settings.progress(Stage(screening, 0.0))
        cost = _costs(problem, drawn, settings.cache)
        points += list(drawn[np.argsort(cost)[: STARTED - 1]])
        settings.progress(Stage(screening, 1.0))

    def tasks(values: Sequence[np.ndarray]) -> list[FitTask]:
        return [problem.task(names, bounds, point) for point in values]

    first = dataclasses.replace(
        settings, max_steps=FIRST_STEPS, tolerance=FitSettings.tolerance, stage="beginning fits"
    )
    started = levenberg_marquardt(problem, tasks(points), first)
    best = sorted(started, key=lambda fit: fit.cost)[:FINISHED]
    finished = tasks([fit.values for fit in best])
    ended = levenberg_marquardt(problem, finished, settings)
    ended = perturbed_restarts(
        problem, finished, ended, dataclasses.replace(settings, stage=f"{settings.stage} from nearby")
    )
    ended = in_order(problem, finished, ended, settings)
    whole = [dataclasses.replace(fit, steps=fit.steps + before.steps) for fit, before in zip(ended, best, strict=True)]
    return sorted(whole, key=lambda fit: fit.cost)
