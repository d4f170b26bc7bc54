"""From many starts at once, each round a batch; starts that have ended, and the worse ones, are dropped on the way.

What a round leaves is ordered by the figures of merit themselves: the smooth terms lead, and do not judge. The state
after a round is a whole: a tuning that is interrupted goes on from it to the same end.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from smajax.control.tune import adam, trust
from smajax.control.tune.evaluate import Rig
from smajax.control.tune.objective import Goal, rank
from smajax.control.tune.scenarios import Members
from smajax.core.files import writing
from smajax.core.names import instead
from smajax.core.result_cache import arrays

RULES = ("trust-region", "adam")
EDGE = 0.03  # share of the box, by logarithm, that starts keep from its bounds
SOFTNESS = 0.1  # of the settling time, share of the band; and the layer of what switches, rad, as it ends
WIDE = 3.0  # times as wide a layer what switches begins with
DROPPED = (0.3, 0.6)  # shares of the rounds after which the worse half of the starts is dropped


@dataclass(frozen=True)
class Effort:
    """How much is tried, and how. Raises ValueError for a rule there is not."""

    tried: int = 32  # points of the box of which the best begin, on plants as believed
    starts: int = 6
    rounds: int = 30  # at most
    seed: int = 0
    by: str = "trust-region"

    def __post_init__(self) -> None:
        if self.by not in RULES:
            raise ValueError(f"no rule `{self.by}`{instead(self.by, RULES, 'there are')}.")
        if min(self.starts, self.rounds) < 1 or self.tried < 0:
            raise ValueError(f"at least one start and one round, not {self.starts} and {self.rounds}.")


@dataclass(frozen=True)
class Descent:
    """Where a tuning stands after a round: arrays by start (S)."""

    round: int
    points: np.ndarray  # (S, gains), of the next round
    alive: np.ndarray  # (S,) bool
    memory: dict[str, np.ndarray]  # the rule's own, (S, ...)
    best: np.ndarray  # (S, gains)
    best_rank: np.ndarray  # (S,)
    costs: np.ndarray  # (rounds, S) judged cost of each round; nan where not run
    excesses: np.ndarray  # (rounds, S)
    ran: np.ndarray  # (rounds,) closed loops up to the end of each round
    begun: int  # closed loops until there were starts
    left_out: int  # loops whose numbers were none
    wild: int  # loops whose slopes were of no use

    def save(self, path: Path) -> None:
        """Whole or not at all."""
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        fields |= {f"memory {name}": array for name, array in fields.pop("memory").items()}
        with writing(path) as file:
            np.savez(file, **fields)

    @property
    def ended(self) -> bool:
        """Nothing is left to do."""
        return self.round >= len(self.ran) or not self.alive.any()

    @property
    def simulations(self) -> int:
        """Closed loops so far."""
        return int(self.ran.max(initial=self.begun))


def load(path: Path) -> Descent | None:
    """What `Descent.save` wrote; None where there is nothing, or it is damaged."""
    whole: dict[str, Any] | None = arrays(path)
    own = {field.name for field in dataclasses.fields(Descent)} - {"memory"}
    if whole is None or not own <= whole.keys():
        return None
    memory = {name.removeprefix("memory "): whole.pop(name) for name in list(whole) if name.startswith("memory ")}
    whole |= {name: int(whole[name]) for name in ("round", "begun", "left_out", "wild")}
    return Descent(**whole, memory=memory)


def begin(rig: Rig, goal: Goal, members: Members, effort: Effort, given: np.ndarray | None) -> Descent:
    """The starts: `given` (a point of the cube), and the best of the points tried."""
    gains, wanted = len(rig.names), effort.starts - (given is not None)
    count = max(effort.tried, wanted, 1)
    drawn = qmc.Sobol(gains, rng=effort.seed).random_base2(int(np.ceil(np.log2(count))))[:count]
    drawn = EDGE + (1.0 - 2.0 * EDGE) * drawn
    if 0 < wanted < len(drawn):
        some = Members(members.rows[members.nominal], members.nominal[members.nominal])
        seen = rig.judged(drawn, some)
        drawn = drawn[np.argsort(rank(goal.cost(seen.judged, some), goal.excess(seen.judged)), kind="stable")]
    points = np.concatenate([np.zeros((0, gains)) if given is None else given[None], drawn[:wanted]])
    count = len(points)
    limits = len(goal.limited)
    memory = adam.begin(points, members, limits) if effort.by == "adam" else trust.begin(points)
    empty = np.full((effort.rounds, count), np.nan)
    return Descent(
        0,
        points,
        np.ones(count, bool),
        memory,
        points.copy(),
        np.full(count, np.inf),
        empty,
        empty.copy(),
        np.zeros(effort.rounds, int),
        rig.simulations,
        0,
        0,
    )


def one_round(rig: Rig, goal: Goal, members: Members, effort: Effort, now: Descent) -> Descent:
    """Every start that is left one step on."""
    number, who = now.round, np.flatnonzero(now.alive)
    wide = WIDE ** (1.0 - min(1.0, 1.5 * number / effort.rounds)) if rig.preset.smoothed else 1.0
    seen = rig.sloped(now.points[who], members, wide * SOFTNESS)
    # What was smoothed to have slopes is judged as it is, in loops of its own.
    judged = seen.judged if rig.preset.smoothed is None else rig.judged(now.points[who], members).judged
    cost, excess = goal.cost(judged, members), goal.excess(judged)
    order = rank(cost, excess)
    best, best_rank = now.best.copy(), now.best_rank.copy()
    better = order < best_rank[who]
    best[who[better]], best_rank[who[better]] = now.points[who[better]], order[better]
    costs, excesses, ran = now.costs.copy(), now.excesses.copy(), now.ran.copy()
    costs[number, who], excesses[number, who], ran[number] = cost, excess, rig.simulations

    rule = adam.move if effort.by == "adam" else trust.move
    own = {name: array[who] for name, array in now.memory.items()}
    following, own, ended = rule(
        goal, seen, members, now.points[who], own, np.random.default_rng([effort.seed, number])
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
    left_out = now.left_out + int(seen.failed.sum())
    wild = now.wild + int(seen.wild(goal.used).sum())
    return Descent(number + 1, points, alive, memory, best, best_rank, costs, excesses, ran, now.begun, left_out, wild)
