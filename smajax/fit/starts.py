"""Where fits start: the best of many points of the box, so that no fit ends in the valley that it happened to start in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import qmc

from smajax.fit.box import Fit, fit_in_box
from smajax.fit.problem import Lane, Problem
from smajax.fit.progress import Progress, quiet
from smajax.fit.solve import misfits

MARGIN = 0.02  # share of the box that is kept from its bounds
TRIED = 64
BEGUN = 8  # fits that are begun
FIRST = 6  # steps, before the worse ones are dropped
KEPT = 4  # and that are carried to their end


def box_points(start: np.ndarray, columns: Sequence[int], box: np.ndarray, count: int, seed: int) -> np.ndarray:
    """`start` (P + 1,) with its `columns` at Sobol points of `box` (C, 2): shape (count, P + 1)."""
    sobol = qmc.Sobol(len(columns), seed=seed).random(count)
    points = np.tile(start, (count, 1))
    points[:, columns] = box[:, 0] + (MARGIN + (1.0 - 2.0 * MARGIN) * sobol) * (box[:, 1] - box[:, 0])
    return points


def from_many_starts(
    problem: Problem,
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    seed: int,
    tried: int = TRIED,
    progress: Progress = quiet,
) -> list[Fit]:
    """Fits of `names`, best first: of `tried` points the best are begun, and the best of those carried to their end."""
    start = problem.start_values()
    points = [start]
    if tried:
        box = np.asarray([bounds[name] for name in names])
        drawn = box_points(start, [problem.names.index(name) for name in names], box, tried, seed)
        progress(f"simulating at {tried} points of the box", 0.0)
        squares = (misfits(problem, drawn) / float(problem.noise_sigma)) ** 2
        cost = np.nan_to_num(squares.sum(axis=(1, 2)), nan=np.inf)
        points += list(drawn[np.argsort(cost)[: BEGUN - 1]])
        progress(f"simulating at {tried} points of the box", 1.0)

    def lanes(values: Sequence[np.ndarray]) -> list[Lane]:
        return [problem.lane(names, bounds, one, len(names)) for one in values]

    begun = fit_in_box(problem, lanes(points), most=FIRST, progress=progress, what="beginning fits")
    best = sorted(begun, key=lambda one: one.cost)[:KEPT]
    ended = fit_in_box(problem, lanes([one.values for one in best]), progress=progress, what="fitting")
    whole = [dataclasses.replace(one, steps=one.steps + before.steps) for one, before in zip(ended, best, strict=True)]
    return sorted(whole, key=lambda one: one.cost)
