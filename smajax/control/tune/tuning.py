"""A whole tuning: settings -> starts -> rounds -> gains, judged before and after on what was tuned on and on what was not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.control.gains_file import Gains
from smajax.control.interface import interface_of
from smajax.control.mismatch import MISMATCHES
from smajax.control.presets import CONTROLLERS
from smajax.control.sweep import positions
from smajax.control.tune.cma_es import Evolution, evolve
from smajax.control.tune.evaluate import LOOPS, STEP, Rig, Seen
from smajax.control.tune.moves import Moves, moved
from smajax.control.tune.multistart import Descent, begin, one_round
from smajax.control.tune.objective import Goal, rank
from smajax.control.tune.scenarios import Members, never_seen, tuned_on
from smajax.control.tune.settings import TuneSettings
from smajax.core.parameters import get_parameters, parameters
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System

LEAST_LOOPS = 8
DRAWN = 8  # plants never seen that are drawn over time


@dataclass(frozen=True)
class Check:
    """Figures before and after on some closed loops: `seen` has two candidates, the preset's gains and the tuned ones."""

    members: Members
    seen: Seen


@dataclass(frozen=True)
class Lines:
    """Angles over time, before and after: (2, loops, time), rad; the loops of the plant as believed come first."""

    time: np.ndarray
    angles: np.ndarray
    targets: np.ndarray  # (loops,)


@dataclass(frozen=True)
class Tuned:
    """What came of a tuning."""

    settings: TuneSettings
    before: Mapping[str, float]
    after: Gains
    box: Mapping[str, tuple[float, float]]
    units: Mapping[str, str]
    checks: Mapping[str, Check]  # `tuned on`, `inside`, `beyond`
    costs: tuple[float, float]  # before and after, on what was tuned on
    excesses: Mapping[str, tuple[float, float]]  # by which a limit is exceeded, of each check
    descent: Descent
    evolution: Evolution
    simulations: int  # closed loops of the search
    lines: Lines
    moves: Moves | None
    air: float  # degC, as the controller believes it

    @property
    def within_limits(self) -> bool:
        """Every limit is met, in what was tuned on and in plants inside of the variation that were never seen."""
        return self.excesses["tuned on"][1] <= 0.0 and self.excesses["inside"][1] <= 0.0


def rig_of(system: System, settings: TuneSettings) -> Rig:
    """The controller on its plant; batches no larger than a round needs."""
    preset = CONTROLLERS[settings.controller]
    plant = preset.plant(system)
    size = settings.starts * tuned_on(settings.set_points, settings.variation, settings.seed).size
    return Rig(
        preset,
        system,
        seconds=settings.seconds,
        interface=interface_of(plant, settings.filtered, settings.noise, settings.period, STEP, settings.delay),
        seed=settings.seed,
        loops=int(np.clip(1 << (size - 1).bit_length(), LEAST_LOOPS, LOOPS)),
    )


def tune(
    system: System,
    settings: TuneSettings,
    *,
    after: Descent | None = None,
    known: Evolution | None = None,
    keep: Callable[[Descent | Evolution], object] = lambda state: None,
    progress: Progress = quiet,
) -> Tuned:
    """Tune, from the preset's gains and the best of points of the box; `keep` gets the starts and every round's end.

    after, known: where an interrupted tuning stood, by slopes and without; it goes on from there to the same end.

    Raises ValueError for settings that make no sense, MissingExtraError without a package that they need.
    """
    settings.check(system)
    settings.check_packages()
    rig, goal, effort = rig_of(system, settings), settings.goal, settings.effort
    members = tuned_on(settings.set_points, settings.variation, settings.seed)
    what = f"tuning {settings.controller}"
    if after is None:
        progress(Stage(f"{what}: {settings.tried} points of the box", 0.0))
        now = begin(rig, goal, members, effort, rig.point(settings.start) if settings.start else rig.before)
        keep(now)
        progress(Stage(f"{what}: {settings.tried} points of the box", 1.0))
    else:
        now, rig.simulations = after, after.simulations
    while not now.ended:
        progress(Stage(what, now.round / effort.rounds))
        now = one_round(rig, goal, members, effort, now)
        keep(now)
    progress(Stage(what, 1.0))
    progress(Stage("judging", 0.0))
    # Rounds judge at the step of tuning; of what they leave the best at a finer one is taken. The preset and what was begun
    # from are among them.
    begun = (rig.point(settings.start),) if settings.start else ()
    best = _best_of(rig, goal, members, (rig.before, *begun, *now.best))
    progress(Stage("judging", 1.0))
    evolution = evolve(
        rig,
        goal,
        members,
        rig.point(best),
        generations=settings.finish,
        seed=settings.seed,
        known=known,
        keep=keep,
        progress=progress,
        what=f"{what}, without slopes",
    )
    progress(Stage("judging", 0.0))
    best = _best_of(rig, goal, members, (rig.point(best), evolution.best))
    searched = rig.simulations
    pair = np.stack([rig.before, rig.point(best)])
    checks = {
        "tuned on": members,
        **never_seen(settings.set_points, settings.variation, settings.unseen, settings.seed),
    }
    judged = {}
    for k, (name, some) in enumerate(checks.items()):
        judged[name] = Check(some, rig.judged(pair, some))
        progress(Stage("judging", (k + 1) / (len(checks) + 1)))
    here = judged["tuned on"]
    cost = goal.cost(here.seen.judged, members)
    excesses = {name: goal.excess(one.seen.judged) for name, one in judged.items()}
    table = parameters(rig.controller)
    tuned = Gains(settings.controller, best)
    lines = _lines(rig, settings, tuned, checks["inside"])
    moves = moved(rig, (rig.controller, tuned.put(rig.system)), settings.set_points)
    progress(Stage("judging", 1.0))
    return Tuned(
        settings,
        dict(zip(rig.names, np.asarray(get_parameters(rig.controller, rig.names)).tolist(), strict=True)),
        tuned,
        rig.box,
        {name: table[name].unit for name in rig.names},
        judged,
        (float(cost[0]), float(cost[1])),
        {name: (float(one[0]), float(one[1])) for name, one in excesses.items()},
        now,
        evolution,
        searched,
        lines,
        moves,
        float(get_parameters(rig.system, [MISMATCHES["ambient"]])[0]),
    )


def _best_of(rig: Rig, goal: Goal, members: Members, points: Sequence[np.ndarray]) -> dict[str, float]:
    """The gains of the best of points of the cube, as a file would hold them."""
    ends = rig.held(np.stack(points))
    judged = rig.judged(ends, members).judged
    return rig.gains(ends[int(np.argmin(rank(goal.cost(judged, members), goal.excess(judged))))])


def _lines(rig: Rig, settings: TuneSettings, tuned: Gains, inside: Members) -> Lines:
    """The plant as believed and some of the plants never seen, at the set points tuned."""
    targets = np.radians(settings.set_points)
    plants = np.unique(inside.rows[:, :-1], axis=0)[:DRAWN]
    plants = np.concatenate([np.ones((1, plants.shape[1])), plants])
    rows = np.column_stack([np.repeat(plants, len(targets), axis=0), np.tile(targets, len(plants))])
    rows = np.column_stack([rows, np.ones(len(rows))])
    angles = [
        positions(
            rig.system,
            controller,
            rig.preset.main_gain,
            rows,
            seconds=settings.seconds,
            dt=STEP,
            interface=rig.interface,
            seed=settings.seed,
        )
        for controller in (rig.controller, tuned.put(rig.system))
    ]
    time = np.arange(angles[0].shape[1]) * STEP
    return Lines(time, np.stack(angles), rows[:, -2])
