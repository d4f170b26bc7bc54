"""The end of a tuning: a search without slopes (CMA-ES, Hansen 2016) around the best gains that slopes have found.

Near the least of the worst another loop is the worst after every step and swings come and go: a slope says little there
(studies/tuning). A generation is ordered by the figures of merit themselves, at the step that judges. A search that is
interrupted goes on to the same end: what was seen is told again, which costs no simulation.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from smajax.control.tune.evaluate import Rig
from smajax.control.tune.objective import Goal, rank
from smajax.control.tune.scenarios import Members
from smajax.core.extras import optional_package
from smajax.core.files import writing
from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import arrays

if TYPE_CHECKING:
    from cmaes import CMA

POPULATION = 24  # candidates of a generation
FIRST, AGAIN = 0.12, 0.04  # sigma of a search as it begins, and of one around its end: share of the box by logarithm
REST = 1e-5  # a search whose candidates are as near to each other has come to rest


@dataclass(frozen=True)
class Evolution:
    """What was seen without slopes: generations (G) of candidates (P)."""

    start: np.ndarray  # (gains,), a point of the cube
    points: np.ndarray  # (G, P, gains), as they were asked for; judged as a file would hold them
    costs: np.ndarray  # (G, P)
    excesses: np.ndarray  # (G, P)
    ran: np.ndarray  # (G,) closed loops of the tuning up to the end of each

    @staticmethod
    def none(start: np.ndarray) -> Evolution:
        """Before the first generation."""
        empty = np.zeros((0, POPULATION))
        return Evolution(start, np.zeros((0, POPULATION, len(start))), empty, empty.copy(), np.zeros(0, int))

    @property
    def generations(self) -> int:
        return len(self.points)

    @property
    def best(self) -> np.ndarray:
        """The best point seen, (gains,); the start before there is one."""
        if not self.generations:
            return self.start
        at = np.unravel_index(np.argmin(rank(self.costs, self.excesses)), self.costs.shape)
        return np.asarray(self.points[at])

    def upto(self, count: int) -> Evolution:
        """The first generations alone."""
        return Evolution(self.start, self.points[:count], self.costs[:count], self.excesses[:count], self.ran[:count])

    def after(self, points: np.ndarray, cost: np.ndarray, excess: np.ndarray, ran: int) -> Evolution:
        """With one generation more."""
        return Evolution(
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


def load(path: Path) -> Evolution | None:
    """What `Evolution.save` wrote; None where there is nothing, or it is damaged."""
    whole = arrays(path)
    if whole is None or whole.keys() != {field.name for field in dataclasses.fields(Evolution)}:
        return None
    found = Evolution(**whole)
    shapes = found.points.shape[:2], found.points.shape[:2], found.points.shape[:1]
    return found if (found.costs.shape, found.excesses.shape, found.ran.shape) == shapes else None


def package() -> ModuleType:
    """cmaes. MissingExtraError says how to install it."""
    return optional_package("cmaes", "tune", "the search without slopes (CMA-ES)", "or leave it out with `--finish 0`")


def _search(mean: np.ndarray, seed: int, number: int) -> CMA:
    found: CMA = package().CMA(
        mean=np.array(mean),
        sigma=AGAIN if number else FIRST,
        bounds=np.tile([0.0, 1.0], (len(mean), 1)),
        seed=int(np.random.default_rng([seed, number]).integers(2**31)),
        population_size=POPULATION,
    )
    return found


def evolve(
    rig: Rig,
    goal: Goal,
    members: Members,
    start: np.ndarray,
    *,
    generations: int,
    seed: int = 0,
    known: Evolution | None = None,
    keep: Callable[[Evolution], object] = lambda found: None,
    progress: Progress = quiet,
    what: str = "without slopes",
) -> Evolution:
    """Candidates around `start` (a point of the cube) for so many generations; `keep` gets each one's end.

    known: of an interrupted search; what it has seen of this one is not simulated again. A search that has come to rest
    begins anew around the best of all. The first candidate of each is where it begins.
    """
    seen = Evolution.none(start)
    if known is not None and np.array_equal(known.start, start) and known.points.shape[1:] == seen.points.shape[1:]:
        seen = known
    number, search, begins, rest = 0, _search(start, seed, 0), start, False
    for k in range(generations):
        progress(Stage(what, k / generations))
        fresh = k == 0 or rest or search.should_stop()
        if fresh and k:
            number, begins = number + 1, seen.upto(k).best
            search = _search(begins, seed, number)
        points = np.stack([search.ask() for _ in range(POPULATION)])
        rest = float(np.ptp(points, axis=0).max()) < REST
        if fresh:
            points[0] = begins
        if k < seen.generations and np.array_equal(seen.points[k], points):
            rig.simulations = max(rig.simulations, int(seen.ran[k]))
        else:
            judged = rig.judged(rig.held(points), members).judged
            seen = seen.upto(k).after(points, goal.cost(judged, members), goal.excess(judged), rig.simulations)
            keep(seen)
        values = rank(seen.costs[k], seen.excesses[k])
        search.tell(list(zip(points, np.where(np.isfinite(values), values, 1e300), strict=True)))
    progress(Stage(what, 1.0))
    return seen.upto(generations)
