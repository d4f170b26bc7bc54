"""Gains on the filter with noise and delay: CMA-ES over the worst-case terms of closed loops, without derivatives."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from cmaes import CMA

from smajax.control.interface import interface_of
from smajax.control.presets import CONTROLLERS
from smajax.control.tune.evaluate import STEP, TuningProblem
from smajax.control.tune.scenarios import tuned_on
from smajax.control.tune.terms import TERMS
from smajax.model.rigs import arm

LIMITS = {"settling_time": 4.0, "overshoot": 2.0, "steady_error": 0.5}
MARGIN = 0.95
VARIATION = {"inertia": 0.2, "damping": 0.2, "convection": 0.2}
FILTER, NOISE, PERIOD, DELAY = "model", 0.1, 0.01, 1  # degrees, s, periods
SET_POINTS = (-40.0, -15.0, 10.0, 35.0, 60.0, 85.0)
POPULATION, SIGMA = 14, 0.2
MOST_OVER, MOST_WORST = 5.0, 20.0  # by which a loop, and the worst one, count at most
WEIGHTS = (10.0, 1.0, 0.1)  # of the mean excess, of the worst, and of what is below the limits


def costs(exact: np.ndarray) -> np.ndarray:
    """(candidates,) from terms (candidates, loops, terms): how far, and in how many loops, the limits are exceeded."""
    columns = [list(TERMS).index(name) for name in LIMITS]
    shares = np.nan_to_num(exact[:, :, columns], nan=1e3) / (MARGIN * np.asarray(list(LIMITS.values())))
    worst = shares.max(axis=2)
    over = np.maximum(worst - 1.0, 0.0)
    parts = (np.minimum(over, MOST_OVER).mean(axis=1), np.minimum(over.max(axis=1), MOST_WORST), worst.mean(axis=1))
    return sum(weight * part for weight, part in zip(WEIGHTS, parts, strict=True))


def searched(name: str, start: Mapping[str, float], generations: int = 25, seed: int = 0) -> dict[str, float]:
    """Gains of a controller of the arm, from `start` on."""
    preset, plant = CONTROLLERS[name], arm()
    problem = TuningProblem(
        preset, plant, interface=interface_of(plant, FILTER, NOISE, PERIOD, PERIOD, DELAY), loops=512
    )
    scenarios = tuned_on(SET_POINTS, VARIATION, 0)
    first = problem.point(start)
    bounds = np.tile([0.0, 1.0], (len(first), 1))
    search = CMA(mean=first, sigma=SIGMA, bounds=bounds, population_size=POPULATION, seed=seed)
    best, least = first, np.inf
    for number in range(generations):
        points = np.stack([search.ask() for _ in range(POPULATION)])
        if number == 0:
            points[0] = first
        found = costs(problem.evaluate(points, scenarios, STEP).exact)
        found = np.where(np.isfinite(found), found, 1e3)
        search.tell(list(zip(points, found, strict=True)))
        if found.min() < least:
            least, best = float(found.min()), points[int(found.argmin())]
    return problem.gains(best)
