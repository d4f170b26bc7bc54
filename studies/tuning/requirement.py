"""One gain set per controller: under 4 s, 2 degrees and 0.5 degrees from -40 to 85 degrees with I, c and h_c each 20 % wrong."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from smajax.fit.progress import Progress
from smajax.gains_file import write_gains
from smajax.system import System
from smajax.tune.members import Members, never_seen, tuned_on
from smajax.tune.objective import Goal
from smajax.tune.settings import TuneSettings
from smajax.tune.terms import TERMS
from smajax.tune.tune import rig_of, tune
from studies.tuning.record import HERE

LIMITS = {"settling_time": 4.0, "overshoot": 2.0, "steady_error": 0.5}
MARGIN = 0.95  # of the limits, to which gains are tuned: between the set points tuned loops are a little worse
ADDED = 40  # of the worst loops, whose set points are added
HOPELESS = 5.0  # a limit exceeded by so many times itself is not tried again
VARIATION = {"inertia": 0.2, "damping": 0.2, "convection": 0.2}


@dataclass(frozen=True)
class Effort:
    """How much is tried, and how finely it is judged."""

    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 85.0)
    judged_every: float = 2.5  # degrees
    added_at: float = 5.0  # degrees: set points that a later pass may add, multiples of it
    tried: int = 64
    starts: int = 8
    rounds: int = 30
    finish: int = 60  # generations without slopes of the first pass, twice as many of the second, ...
    unseen: int = 32
    passes: int = 4
    seconds: float = 10.0


def judged_on(effort: Effort) -> Members:
    """The whole range of set points: the plant as believed, every corner, and plants drawn within."""
    low, high = min(effort.set_points), max(effort.set_points)
    every = list(np.arange(low, high + 1e-9, effort.judged_every))
    corners = tuned_on(every, VARIATION, 0)
    drawn = never_seen([low, high], VARIATION, effort.unseen, 7)["inside"]
    plants = np.unique(drawn.rows[:, :-1], axis=0)
    rows = [[*plant, target] for plant, target in itertools.product(plants, np.radians(every))]
    return Members(np.concatenate([corners.rows, rows]), np.append(corners.nominal, np.zeros(len(rows), bool)))


def _told(judged: np.ndarray, members: Members, seconds: float) -> dict[str, Any]:
    """The worst of each limited term over loops (M, terms), where, and how many loops meet its limit."""
    told: dict[str, Any] = {}
    for name, limit in LIMITS.items():
        values = judged[:, list(TERMS).index(name)]
        at = int(np.argmax(values))
        never = name == "settling_time" and values[at] >= 2.0 * seconds
        told[name] = {
            "worst": None if never else float(f"{values[at]:.4g}"),
            "at_deg": round(float(np.degrees(members.targets[at])), 1),
            "loops_within": int((values <= limit).sum()),
        }
    met = (judged[:, [list(TERMS).index(name) for name in LIMITS]] <= list(LIMITS.values())).all(axis=1)
    told["loops"], told["loops_that_meet_all"] = len(judged), int(met.sum())
    return told


def requirement(system: System, controller: str, effort: Effort, progress: Progress, keep: bool) -> dict[str, Any]:
    """Tune one controller with the requirement as limits; judge preset and result on every set point and plant."""
    settings = TuneSettings(
        controller,
        effort.set_points,
        VARIATION,
        limits={name: MARGIN * limit for name, limit in LIMITS.items()},
        tried=effort.tried,
        starts=effort.starts,
        rounds=effort.rounds,
        finish=effort.finish,
        seconds=effort.seconds,
        unseen=effort.unseen,
    )
    goal, members = Goal(limits=LIMITS), judged_on(effort)
    loops = rounds = generations = wild = 0
    for number in range(effort.passes):
        found = tune(system, settings, progress=progress)
        rig = rig_of(system, settings)
        pair = np.stack([rig.before, rig.point(found.after.values)])
        seen = rig.judged(pair, members)
        excess = goal.excess(seen.judged)
        loops, rounds = loops + found.simulations, rounds + found.descent.round
        generations += found.evolution.generations
        wild += found.descent.wild
        over = (seen.judged[1][:, goal.limited] / goal.bounds - 1.0).max(axis=1)
        if excess[1] <= 0.0 or not np.isfinite(over).all() or excess[1] > HOPELESS:
            break
        # Once more from there, with the set points at which it fails by most.
        angles = np.degrees(members.targets).round(6)
        addable = np.flatnonzero((angles % effort.added_at == 0.0) & (over > 0.0))
        worst = np.unique(angles[addable[np.argsort(over[addable])[-ADDED:]]])
        settings = dataclasses.replace(
            settings,
            set_points=tuple(sorted({*settings.set_points, *map(float, worst)})),
            start=found.after.values,
            starts=max(2, effort.starts // 2),
            tried=effort.tried // 2,
            finish=effort.finish * (number + 2),
            seed=number + 1,
        )
    if keep:
        (HERE / "gains").mkdir(exist_ok=True)
        write_gains(HERE / "gains" / f"{controller}.json", found.after, found.units, {"tuned": settings.record()})
    nominal = members.nominal
    return {
        "gains": dict(found.after.values),
        "met": bool(excess[1] <= 0.0),
        "limit_exceeded_by_share": {"before": float(excess[0]), "after": float(excess[1])},
        "before": _told(seen.judged[0], members, effort.seconds),
        "after": _told(seen.judged[1], members, effort.seconds),
        "after_on_the_plant_as_believed": _told(
            seen.judged[1][nominal], Members(members.rows[nominal], nominal[nominal]), effort.seconds
        ),
        "closed_loops": loops,
        "rounds": rounds,
        "generations_without_slopes": generations,
        "set_points_tuned_deg": list(found.settings.set_points),
        "slopes_of_no_use": wild,
    }
