"""The gradient beside Nelder-Mead (scipy), CMA-ES (cmaes) and a grid: the same scenarios, cost, box and count of closed loops.

Every search sees the cost as it is judged (the settling time itself, the worst loop itself). All but the grid begin from
the same points of the box, tried on the plant as believed and counted; the presets' gains are given to none.
"""

from __future__ import annotations

import contextlib
import itertools
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from cmaes import CMA
from scipy.optimize import minimize

from smajax.control.presets import CONTROLLERS
from smajax.control.tune.evaluate import LOOPS, STEP, TuningProblem
from smajax.control.tune.multistart import Effort, begin, next_round
from smajax.control.tune.objective import Goal
from smajax.control.tune.scenarios import Scenarios, tuned_on
from smajax.model.system import System

VARIATION = {"inertia": 0.2, "damping": 0.2, "convection": 0.2}
SET_POINTS = (-40.0, 20.0, 85.0)
SIGMA = 0.2  # of CMA-ES, share of the box by logarithm
TRIED, TRIED_ALONE = 32, 8  # points tried on the plant as believed: a few candidates' worth of loops


@dataclass(frozen=True)
class Problem:
    """What is searched."""

    controller: str
    objective: str
    set_points: tuple[float, ...] = SET_POINTS
    varied: bool = True
    seconds: float = 10.0

    @property
    def tried(self) -> int:
        return TRIED if self.varied else TRIED_ALONE

    @property
    def name(self) -> str:
        return f"{self.controller}, {self.objective}, {'plants 20 % wrong' if self.varied else 'plant as believed'}"


PROBLEMS = (
    Problem("pid", "worst"),
    Problem("sld", "worst"),
    Problem("pid", "nominal", varied=False),
    Problem("backstepping1", "nominal", varied=False),
)


class Spent(Exception):
    """The closed loops are used up."""


class Counted:
    """The validated cost of points of the cube, with the closed loops so far and the best after each."""

    def __init__(self, rig: TuningProblem, goal: Goal, scenarios: Scenarios, budget: int) -> None:
        self.rig, self.goal, self.scenarios, self.budget = rig, goal, scenarios, budget
        self.course: list[tuple[int, float]] = []

    def costs(self, points: np.ndarray) -> np.ndarray:
        """Costs (C,) of points (C, gains); raises Spent when none of the budget is left."""
        left = (self.budget - self.rig.simulations) // self.scenarios.size
        if left < 1:
            raise Spent
        before = self.rig.simulations
        some = np.clip(points[:left], 0.0, 1.0)
        result = self.goal.cost(self.rig.evaluate(some, self.scenarios, STEP).exact, self.scenarios)
        for k, cost in enumerate(result):
            best = min(float(cost), self.course[-1][1] if self.course else np.inf)
            self.course.append((before + (k + 1) * self.scenarios.size, best))
        if left < len(points):
            raise Spent
        return result


def _by_gradient(
    problem: Problem, rig: TuningProblem, goal: Goal, scenarios: Scenarios, budget: int, seed: int, rule: str
) -> list[tuple[int, float]]:
    course: list[tuple[int, float]] = []
    best = np.inf
    part = 0
    # One start after the other, each the best of other points, until nothing is left.
    while rig.simulations < budget:
        effort = Effort(problem.tried, 1, 40, seed + 100 * part, rule)
        now = begin(rig, goal, scenarios, effort, None)
        while not now.ended and rig.simulations + scenarios.size * int(now.alive.sum()) <= budget:
            now = next_round(rig, goal, scenarios, effort, now)
            best = min(best, float(np.nanmin(now.costs[now.round - 1])))
            course.append((rig.simulations, best))
        if not now.ended:
            break
        part += 1
    return course


def _nelder_mead(counted: Counted, start: np.ndarray, seed: int) -> None:
    draw = np.random.default_rng(seed)
    begins = start
    while True:
        minimize(
            lambda point: float(counted.costs(np.asarray(point)[None])[0]),
            begins,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(start),
            options={"xatol": 1e-3, "fatol": 1e-3, "initial_simplex": _simplex(begins)},
        )
        begins = draw.uniform(0.05, 0.95, len(start))


def _simplex(start: np.ndarray) -> np.ndarray:
    corners = np.tile(start, (len(start) + 1, 1))
    for k in range(len(start)):
        corners[k + 1, k] += 0.15 if start[k] < 0.5 else -0.15
    return corners


def _cma_es(counted: Counted, start: np.ndarray, seed: int) -> None:
    bounds = np.tile([0.0, 1.0], (len(start), 1))
    number = 0
    begins = start
    while True:
        search = CMA(mean=begins, sigma=SIGMA, bounds=bounds, seed=seed + number)
        while not search.should_stop():
            points = np.stack([search.ask() for _ in range(search.population_size)])
            search.tell(list(zip(points, counted.costs(points), strict=True)))
        number += 1
        begins = np.random.default_rng(seed + number).uniform(0.05, 0.95, len(start))


def _grid(counted: Counted, gains: int) -> None:
    most = counted.budget // counted.scenarios.size
    side = int(np.floor(most ** (1.0 / gains) + 1e-9))
    ends = np.linspace(0.0, 1.0, max(side, 2) + 2)[1:-1]
    points = np.asarray(list(itertools.product(ends, repeat=gains)))
    # In no order, so that the course is not that of a corner.
    np.random.default_rng(0).shuffle(points)
    for some in np.array_split(points, max(1, len(points) // 16)):
        counted.costs(some)


def searched(system: System, problem: Problem, way: str, budget: int, seed: int) -> dict[str, Any]:
    """The course of one search: [closed loops, best cost] after each of its evaluations, and the seconds it took."""
    goal = Goal(problem.objective)
    scenarios = tuned_on(problem.set_points, VARIATION if problem.varied else {}, 0)
    loops = int(np.clip(1 << (scenarios.size - 1).bit_length(), 16, LOOPS))
    rig = TuningProblem(CONTROLLERS[problem.controller], system, seconds=problem.seconds, loops=loops)
    began = clock.monotonic()
    if way in ("trust-region", "adam"):
        course = _by_gradient(problem, rig, goal, scenarios, budget, seed, way)
    else:
        counted = Counted(rig, goal, scenarios, budget)
        run: Callable[[], None]
        if way == "grid":
            run = lambda: _grid(counted, len(rig.names))  # noqa: E731
        else:
            start = begin(rig, goal, scenarios, Effort(problem.tried, 1, 1, seed), None).points[0]
            own = _nelder_mead if way == "nelder-mead" else _cma_es
            run = lambda: own(counted, start, seed)  # noqa: E731
        with contextlib.suppress(Spent):
            run()
        course = counted.course
    # Only where it becomes better.
    improvements = [one for k, one in enumerate(course) if k == 0 or one[1] < course[k - 1][1]]
    return {
        "course": [[loops, float(f"{cost:.5g}")] for loops, cost in improvements],
        "closed_loops": course[-1][0] if course else 0,
        "seconds": round(clock.monotonic() - began, 1),
    }
