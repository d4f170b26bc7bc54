"""The end of a tuning: CMA-ES (Hansen 2016) without gradients around the best gains of the gradient search.

Near the minimum of the worst case another loop is the worst after every step, so that a gradient describes little there
(studies/tuning). A generation is ordered by the figures of merit themselves, at the fine time step. An interrupted search
resumes to the same end: the stored generations are replayed without a simulation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from smajax.control.tune.evaluate import TuningProblem
from smajax.control.tune.objective import Goal, rank
from smajax.control.tune.scenarios import Scenarios
from smajax.core.files import writing
from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import arrays

if TYPE_CHECKING:
    from cmaes import CMA

POPULATION = 24  # candidates of a generation
SIGMA, RESTART_SIGMA = 0.12, 0.04  # of the first search and of restarts: fraction of the box by logarithm
CONVERGED = 1e-5  # a search whose candidates are as near to each other has converged


@dataclass(frozen=True)
class CmaEsState:
    """Results of generations (G) of candidates (P)."""

    start: np.ndarray  # (gains,), a point of the cube
    points: np.ndarray  # (G, P, gains), as CMA-ES drew them; evaluated with rounded gains
    costs: np.ndarray  # (G, P)
    excesses: np.ndarray  # (G, P)
    ran: np.ndarray  # (G,) number of closed loops of the tuning up to the end of each

    @staticmethod
    def none(start: np.ndarray) -> CmaEsState:
        """The state before the first generation."""
        empty = np.zeros((0, POPULATION))
        return CmaEsState(start, np.zeros((0, POPULATION, len(start))), empty, empty.copy(), np.zeros(0, int))

    @property
    def generations(self) -> int:
        return len(self.points)

    @property
    def best(self) -> np.ndarray:
        """The best point evaluated, (gains,); the start before there is one."""
        if not self.generations:
            return self.start
        at = np.unravel_index(np.argmin(rank(self.costs, self.excesses)), self.costs.shape)
        return np.asarray(self.points[at])

    def upto(self, count: int) -> CmaEsState:
        """The first generations alone."""
        return CmaEsState(self.start, self.points[:count], self.costs[:count], self.excesses[:count], self.ran[:count])

    def after(self, points: np.ndarray, cost: np.ndarray, excess: np.ndarray, ran: int) -> CmaEsState:
        """With one generation more."""
        return CmaEsState(
            self.start,
            np.concatenate([self.points, points[None]]),
            np.concatenate([self.costs, cost[None]]),
            np.concatenate([self.excesses, excess[None]]),
            np.append(self.ran, ran),
        )

    def save(self, path: Path) -> None:
        """Whole or not at all."""
        with writing(path) as file:
            np.savez(file, **{field.name: getattr(self, field.name) for field in dataclasses.fields(self)})


def load(path: Path) -> CmaEsState | None:
    """The file of `CmaEsState.save`; None where it does not exist or is damaged."""
    whole = arrays(path)
    if whole is None or whole.keys() != {field.name for field in dataclasses.fields(CmaEsState)}:
        return None
    result = CmaEsState(**whole)
    shapes = result.points.shape[:2], result.points.shape[:2], result.points.shape[:1]
    return result if (result.costs.shape, result.excesses.shape, result.ran.shape) == shapes else None


def _search(mean: np.ndarray, seed: int, number: int) -> CMA:
    from cmaes import CMA  # imported when a search begins: `--finish 0` and `--help` do without

    return CMA(
        mean=np.array(mean),
        sigma=RESTART_SIGMA if number else SIGMA,
        bounds=np.tile([0.0, 1.0], (len(mean), 1)),
        seed=int(np.random.default_rng([seed, number]).integers(2**31)),
        population_size=POPULATION,
    )


@dataclass(frozen=True)
class SearchTask:
    """A tuning problem with its objective and the closed loops of one candidate."""

    problem: TuningProblem
    goal: Goal
    scenarios: Scenarios

    def score(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(cost, excess over the limits) of points (C, gains), rounded as a gains file holds them."""
        exact = self.problem.evaluate(self.problem.rounded(points), self.scenarios).exact
        return self.goal.cost(exact, self.scenarios), self.goal.excess(exact)


def evolve(
    task: SearchTask,
    start: np.ndarray,
    *,
    generations: int,
    seed: int = 0,
    known: CmaEsState | None = None,
    save: Callable[[CmaEsState], object] = lambda state: None,
    progress: Progress = quiet,
    what: str = "CMA-ES",
) -> CmaEsState:
    """Candidates around `start` (a point of the unit cube) for so many generations; `save` gets the state after each.

    known: of an interrupted search; its generations are not simulated again. A search that has converged restarts around the
    best of all. The first candidate of each search is its centre.
    """
    state = CmaEsState.none(start)
    if known is not None and np.array_equal(known.start, start) and known.points.shape[1:] == state.points.shape[1:]:
        state = known
    if generations == 0:
        return state.upto(0)
    number, search, centre, converged = 0, _search(start, seed, 0), start, False
    for k in range(generations):
        progress(Stage(what, k / generations))
        restarted = k == 0 or converged or search.should_stop()
        if restarted and k:
            number, centre = number + 1, state.upto(k).best
            search = _search(centre, seed, number)
        points = np.stack([search.ask() for _ in range(POPULATION)])
        converged = float(np.ptp(points, axis=0).max()) < CONVERGED
        if restarted:
            points[0] = centre
        if k < state.generations and np.array_equal(state.points[k], points):
            task.problem.simulations = max(task.problem.simulations, int(state.ran[k]))
        else:
            cost, excess = task.score(points)
            state = state.upto(k).after(points, cost, excess, task.problem.simulations)
            save(state)
        values = rank(state.costs[k], state.excesses[k])
        search.tell(list(zip(points, np.where(np.isfinite(values), values, 1e300), strict=True)))
    progress(Stage(what, 1.0))
    return state.upto(generations)
