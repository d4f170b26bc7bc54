"""Gradient descent from many starting points at once, each round a batch; converged and worse starts are dropped.

Candidates are compared by the exact figures of merit; the smooth terms give the steps only. The state after a round is
complete: an interrupted tuning resumes from it to the same end.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from smajax.control.tune import adam, trust
from smajax.control.tune.evaluate import TuningProblem
from smajax.control.tune.objective import Goal, rank
from smajax.control.tune.scenarios import Scenarios
from smajax.core.files import writing
from smajax.core.names import close_matches
from smajax.core.result_cache import arrays
from smajax.core.sobol import sobol_points

RULES = ("trust-region", "adam")
EDGE = 0.03  # fraction of the box, by logarithm: distance of starts from its bounds
SOFTNESS = 0.1  # of the settling time, fraction of the band; final layer of a switching controller, rad
WIDE = 3.0  # times that width: the initial layer
DROPPED = (0.3, 0.6)  # fractions of the rounds after which the worse half of the starts is dropped


@dataclass(frozen=True)
class Effort:
    """The size of the search and its rule. Raises ValueError for an unknown rule."""

    tried: int = 32  # points of the box, on unperturbed plants; the best are starting points
    starts: int = 6
    rounds: int = 30  # at most
    seed: int = 0
    by: str = "trust-region"

    def __post_init__(self) -> None:
        if self.by not in RULES:
            raise ValueError(f"no rule `{self.by}`{close_matches(self.by, RULES, 'there are')}.")
        if min(self.starts, self.rounds) < 1 or self.tried < 0:
            raise ValueError(f"at least one start and one round, not {self.starts} and {self.rounds}.")


@dataclass(frozen=True)
class MultistartState:
    """The state of a tuning after a round: arrays by start (S)."""

    round: int
    points: np.ndarray  # (S, gains), of the next round
    alive: np.ndarray  # (S,) bool
    memory: dict[str, np.ndarray]  # the rule's own, (S, ...)
    best: np.ndarray  # (S, gains)
    best_rank: np.ndarray  # (S,)
    costs: np.ndarray  # (rounds, S) exact cost of each round; NaN where not run
    excesses: np.ndarray  # (rounds, S)
    ran: np.ndarray  # (rounds,) number of closed loops up to the end of each round
    initial_loops: int  # number of closed loops that chose the starts
    non_finite: int  # number of loops with values that are not finite
    unusable: int  # number of loops with unusable gradients

    def save(self, path: Path) -> None:
        """Whole or not at all."""
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        fields |= {f"memory {name}": array for name, array in fields.pop("memory").items()}
        with writing(path) as file:
            np.savez(file, **fields)

    @property
    def ended(self) -> bool:
        """Every start has converged, or no rounds are left."""
        return self.round >= len(self.ran) or not self.alive.any()

    @property
    def simulations(self) -> int:
        """Closed loops so far."""
        return int(self.ran.max(initial=self.initial_loops))


def load(path: Path) -> MultistartState | None:
    """The file of `MultistartState.save`; None where it does not exist or is damaged."""
    whole: dict[str, Any] | None = arrays(path)
    own = {field.name for field in dataclasses.fields(MultistartState)} - {"memory"}
    if whole is None or not own <= whole.keys():
        return None
    memory = {name.removeprefix("memory "): whole.pop(name) for name in list(whole) if name.startswith("memory ")}
    whole |= {name: int(whole[name]) for name in ("round", "initial_loops", "non_finite", "unusable")}
    return MultistartState(**whole, memory=memory)


def begin(
    problem: TuningProblem, goal: Goal, scenarios: Scenarios, effort: Effort, first: np.ndarray | None
) -> MultistartState:
    """The starts: `first` (a point of the cube), and the best of the points tried."""
    gains, wanted = len(problem.names), effort.starts - (first is not None)
    count = max(effort.tried, wanted, 1)
    drawn = sobol_points(count, gains, effort.seed)
    drawn = EDGE + (1.0 - 2.0 * EDGE) * drawn
    if 0 < wanted < len(drawn):
        some = Scenarios(scenarios.rows[scenarios.nominal], scenarios.nominal[scenarios.nominal])
        seen = problem.evaluate(drawn, some)
        drawn = drawn[np.argsort(rank(goal.cost(seen.exact, some), goal.excess(seen.exact)), kind="stable")]
    points = np.concatenate([np.zeros((0, gains)) if first is None else first[None], drawn[:wanted]])
    count = len(points)
    limits = len(goal.limited)
    memory = adam.begin(points, scenarios, limits) if effort.by == "adam" else trust.begin(points)
    empty = np.full((effort.rounds, count), np.nan)
    return MultistartState(
        round=0,
        points=points,
        alive=np.ones(count, bool),
        memory=memory,
        best=points.copy(),
        best_rank=np.full(count, np.inf),
        costs=empty,
        excesses=empty.copy(),
        ran=np.zeros(effort.rounds, int),
        initial_loops=problem.simulations,
        non_finite=0,
        unusable=0,
    )


def next_round(
    problem: TuningProblem, goal: Goal, scenarios: Scenarios, effort: Effort, now: MultistartState
) -> MultistartState:
    """One step of every remaining start."""
    number, who = now.round, np.flatnonzero(now.alive)
    wide = WIDE ** (1.0 - min(1.0, 1.5 * number / effort.rounds)) if problem.preset.smoothed else 1.0
    seen = problem.evaluate_gradients(now.points[who], scenarios, wide * SOFTNESS)
    # A controller that was smoothed for its gradients is compared without smoothing, in loops of its own.
    judged = seen.exact if problem.preset.smoothed is None else problem.evaluate(now.points[who], scenarios).exact
    cost, excess = goal.cost(judged, scenarios), goal.excess(judged)
    order = rank(cost, excess)
    best, best_rank = now.best.copy(), now.best_rank.copy()
    better = order < best_rank[who]
    best[who[better]], best_rank[who[better]] = now.points[who[better]], order[better]
    costs, excesses, ran = now.costs.copy(), now.excesses.copy(), now.ran.copy()
    costs[number, who], excesses[number, who], ran[number] = cost, excess, problem.simulations

    rule = adam.move if effort.by == "adam" else trust.move
    own = {name: array[who] for name, array in now.memory.items()}
    following, own, ended = rule(
        goal, seen, scenarios, now.points[who], own, np.random.default_rng([effort.seed, number])
    )
    points = now.points.copy()
    points[who] = following
    memory = {name: array.copy() for name, array in now.memory.items()}
    for name, array in own.items():
        whole = memory.setdefault(name, np.zeros((len(points), *array.shape[1:])))
        whole[who] = array
    alive = now.alive.copy()
    alive[who[ended]] = False
    if number + 1 in {max(1, round(share * effort.rounds)) for share in DROPPED} and len(who) > 1:
        alive[who[np.argsort(best_rank[who], kind="stable")[-(-len(who) // 2) :]]] = False
    non_finite = now.non_finite + int(seen.failed.sum())
    unusable = now.unusable + int(seen.unusable(goal.used).sum())
    return MultistartState(
        round=number + 1,
        points=points,
        alive=alive,
        memory=memory,
        best=best,
        best_rank=best_rank,
        costs=costs,
        excesses=excesses,
        ran=ran,
        initial_loops=now.initial_loops,
        non_finite=non_finite,
        unusable=unusable,
    )
