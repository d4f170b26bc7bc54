"""Where fits start: the best of many points of the box, so that no fit ends in the valley that it happened to start in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import qmc

from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import Kept
from smajax.fit.levenberg_marquardt import ENOUGH, Fit, fit_in_box
from smajax.fit.predicted import squares
from smajax.fit.problem import Lane, Problem

MARGIN = 0.02  # share of the box that is kept from its bounds
TRIED = 64
BEGUN = 8  # fits that are begun
FIRST = 6  # steps, before the worse ones are dropped
KEPT = 4  # and that are carried to their end
NEARBY = 0.02  # of the box: how far a fit that has ended is put off to end once more
HOPS = 4  # a power of two, for Sobol's points


def box_points(start: np.ndarray, columns: Sequence[int], box: np.ndarray, count: int, seed: int) -> np.ndarray:
    """`start` (P,) with its `columns` at Sobol points of `box` (C, 2): shape (count, P)."""
    sobol = qmc.Sobol(len(columns), seed=seed).random(count)
    points = np.tile(start, (count, 1))
    points[:, columns] = box[:, 0] + (MARGIN + (1.0 - 2.0 * MARGIN) * sobol) * (box[:, 1] - box[:, 0])
    return points


def _costs(problem: Problem, points: np.ndarray, kept: Kept) -> np.ndarray:
    """Sum of squares at every point; infinite where the model gives no number."""
    key = kept.key(problem, "costs", points)
    known = kept.load(key)
    if known is not None:
        return known["cost"]
    before = np.stack([problem.priors.rows(point) for point in points]) ** 2
    cost = np.nan_to_num(squares(problem, points) + before.sum(axis=1), nan=np.inf)
    kept.save(key, {"cost": cost})
    return cost


def hopped(
    problem: Problem,
    lanes: Sequence[Lane],
    ended: Sequence[Fit],
    *,
    enough: float = ENOUGH,
    kept: Kept | None = None,
    progress: Progress = quiet,
    what: str = "fitting from nearby",
) -> list[Fit]:
    """Every fit once more from `HOPS` points around its end, the best of them all.

    Where a run just meets the start of a branch, or just does not, the cost has a valley on either side of that; they lie
    a hundredth of the box apart, and no fit goes from one to the other.
    """
    around, owner = [], []
    for k, (lane, one) in enumerate(zip(lanes, ended, strict=True)):
        if not len(lane.slots):
            continue
        place = (one.values[lane.slots] - lane.low) / (lane.high - lane.low)
        off = NEARBY * (2.0 * qmc.Sobol(len(lane.slots), seed=k).random(HOPS) - 1.0)
        around += [lane._replace(values=lane.at(np.clip(place + way, 0.0, 1.0))) for way in off]
        owner += [k] * HOPS
    best = list(ended)
    again = fit_in_box(problem, around, enough=enough, kept=kept, progress=progress, what=what)
    for k, one in zip(owner, again, strict=True):
        if one.cost < best[k].cost:
            best[k] = dataclasses.replace(one, steps=one.steps + ended[k].steps)
    return best


def from_many_starts(
    problem: Problem,
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    seed: int,
    tried: int = TRIED,
    progress: Progress = quiet,
    kept: Kept | None = None,
    enough: float = ENOUGH,
    what: str = "fitting",
) -> list[Fit]:
    """Fits of `names`, best first: of `tried` points the best are begun, and the best of those carried to their end."""
    kept = kept or Kept()
    start = problem.start_values()
    points = [start]
    if tried and names:
        box = np.asarray([bounds[name] for name in names])
        drawn = box_points(start, [problem.names.index(name) for name in names], box, tried, seed)
        progress(Stage(f"simulating at {tried} points of the box", 0.0))
        cost = _costs(problem, drawn, kept)
        points += list(drawn[np.argsort(cost)[: BEGUN - 1]])
        progress(Stage(f"simulating at {tried} points of the box", 1.0))

    def lanes(values: Sequence[np.ndarray]) -> list[Lane]:
        return [problem.lane(names, bounds, one) for one in values]

    begun = fit_in_box(problem, lanes(points), most=FIRST, kept=kept, progress=progress, what="beginning fits")
    best = sorted(begun, key=lambda one: one.cost)[:KEPT]
    going = lanes([one.values for one in best])
    ended = fit_in_box(problem, going, enough=enough, kept=kept, progress=progress, what=what)
    ended = hopped(problem, going, ended, enough=enough, kept=kept, progress=progress, what=f"{what} from nearby")
    whole = [dataclasses.replace(one, steps=one.steps + before.steps) for one, before in zip(ended, best, strict=True)]
    return sorted(whole, key=lambda one: one.cost)
