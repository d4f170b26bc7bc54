"""Gains on the filter with noise and delay: CMA-ES over the worst-case terms of closed loops, without derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from cmaes import CMA
from scipy.stats import qmc

from smajax.control.controllers.preset import Box
from smajax.control.least_time import Largest
from smajax.control.presets import CONTROLLERS
from smajax.control.signal_path import interface_of
from smajax.control.sweep.batched_loops import LoopSetup
from smajax.control.sweep.batched_loops import least_times as batched_least_times
from smajax.control.sweep.grid import loop_rows
from smajax.control.tune.evaluate import STEP, TuningProblem
from smajax.control.tune.scenarios import Scenarios, tuned_on
from smajax.control.tune.terms import SETTLING, TERMS
from smajax.core.parameters import parameters
from smajax.model.rigs import arm
from smajax.model.system import System

LIMITS = {"settling_time": 4.0, "overshoot": 2.0, "steady_error": 0.5}
MARGIN = 0.95
VARIATION = {"inertia": 0.2, "damping": 0.2, "convection": 0.2}
FILTER, NOISE, PERIOD, DELAY = "adaptive", 0.1, 0.01, 1  # degrees, s, periods
QUANTUM = 0.1  # degrees, between two values of the reading, of the loops that judge: gains were searched without
SET_POINTS = (-40.0, -15.0, 10.0, 35.0, 60.0, 85.0)
LOW, HIGH = -40.0, 85.0  # degrees
FULL = 10.0  # V
LONGEST = 10.0  # s, in which a set point has to be reached
DRAWN, SEED = 64, 20261126  # loops drawn beside the corners: other than those that judge
ALSO = {"largest_voltage": (7.0, FULL), "braking": (2.0, 200.0), "rate_filter": (0.002, 0.1)}
POPULATION, SIGMA = 14, 0.2
MOST_OVER, MOST_WORST = 5.0, 20.0  # by which a loop, and the worst one, count at most
WEIGHTS = (10.0, 1.0, 0.1)  # of the mean excess, of the worst, and of what is below the limits


def drawn(count: int, seed: int) -> np.ndarray:
    """Rows of plants drawn within the variation, with a set point each."""
    shares = qmc.Sobol(len(VARIATION) + 1, rng=seed).random(count)
    named = {name: 1.0 + (2.0 * shares[:, k] - 1.0) * size for k, (name, size) in enumerate(VARIATION.items())}
    return loop_rows(named, np.radians(LOW + (HIGH - LOW) * shares[:, -1]))


def searched_on() -> Scenarios:
    """The nominal plant and the corners at six set points, and plants drawn."""
    corners, other = tuned_on(SET_POINTS, VARIATION, 0), drawn(DRAWN, SEED)[:, :-1]
    return Scenarios(np.concatenate([corners.rows, other]), np.append(corners.nominal, np.zeros(len(other), bool)))


def least_times(
    rows: np.ndarray, limit: float = FULL, section: Callable[[System], System] = lambda plant: plant
) -> np.ndarray:
    """Seconds in which that command is first within the band of each row's set point on its plant; infinite where it never is.

    section: makes the plant of a section of the source from the arm, as `ControllerPreset.plant` does.
    """
    return batched_least_times(LoopSetup(section(arm()), Largest(limit), "largest_voltage", LONGEST, STEP), rows, limit)


def costs(exact: np.ndarray, least: np.ndarray | None = None, quick: float = 0.0) -> np.ndarray:
    """(candidates,) from terms (candidates, loops, terms): how far, and in how many loops, the limits are exceeded.

    quick: weight of the settling time over the `least` one (loops,), s.
    """
    columns = [list(TERMS).index(name) for name in LIMITS]
    shares = np.nan_to_num(exact[:, :, columns], nan=1e3) / (MARGIN * np.asarray(list(LIMITS.values())))
    worst = shares.max(axis=2)
    over = np.maximum(worst - 1.0, 0.0)
    parts = (np.minimum(over, MOST_OVER).mean(axis=1), np.minimum(over.max(axis=1), MOST_WORST), worst.mean(axis=1))
    result = sum(weight * part for weight, part in zip(WEIGHTS, parts, strict=True))
    if least is None:
        return result
    return result + quick * np.minimum(exact[:, :, SETTLING] / least, MOST_WORST).mean(axis=1)


def box_of(name: str) -> Box:
    """The preset's, and what a controller has of `ALSO`: the limit of the command is the drive's at most."""
    preset = CONTROLLERS[name]
    there = parameters(preset.make(arm()))
    return {**preset.box, **{gain: bounds for gain, bounds in ALSO.items() if gain in there}}


def searched(
    name: str, start: Mapping[str, float], generations: int = 25, seed: int = 0, quick: float = 0.0
) -> dict[str, float]:
    """Gains of a controller of the arm, from `start` on. quick: as in `costs`."""
    preset, plant = CONTROLLERS[name], arm()
    problem = TuningProblem(
        preset, plant, box=box_of(name), interface=interface_of(plant, FILTER, NOISE, PERIOD, PERIOD, DELAY), loops=512
    )
    scenarios = searched_on()
    least = least_times(np.append(scenarios.rows, np.ones((scenarios.size, 1)), axis=1))
    first = problem.point(start)
    bounds = np.tile([0.0, 1.0], (len(first), 1))
    search = CMA(mean=first, sigma=SIGMA, bounds=bounds, population_size=POPULATION, seed=seed)
    best, lowest = first, np.inf
    for number in range(generations):
        points = np.stack([search.ask() for _ in range(POPULATION)])
        if number == 0:
            points[0] = first
        found = costs(problem.evaluate(points, scenarios, STEP).exact, least, quick)
        found = np.where(np.isfinite(found), found, 1e3)
        search.tell(list(zip(points, found, strict=True)))
        if found.min() < lowest:
            lowest, best = float(found.min()), points[int(found.argmin())]
    return problem.gains(best)
