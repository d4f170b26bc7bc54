"""A whole tuning: settings -> starts -> rounds -> gains, evaluated before and after on what was tuned on and on what was not."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.control.controllers.base import AbstractController
from smajax.control.gains_file import Gains, fixed_parameters
from smajax.control.loop_settings import LoopInUse, LoopSettings, settings_of
from smajax.control.mismatch import MISMATCHES
from smajax.control.plants import Plants, PlantSet, carrying, plant_set
from smajax.control.presets import CONTROLLERS
from smajax.control.scales import unit_on
from smajax.control.signal_path import interface_of
from smajax.control.sweep.batched_loops import LoopSetup, integrated_setup, positions
from smajax.control.tune.cma_es import CmaEsState, SearchTask, evolve
from smajax.control.tune.evaluate import FINE, LOOPS, STEP, Evaluation, TuningProblem
from smajax.control.tune.moves import Moves, moved
from smajax.control.tune.multistart import MultistartState, begin, next_round
from smajax.control.tune.objective import rank
from smajax.control.tune.scenarios import Scenarios, held_out, tuned_on
from smajax.control.tune.settings import TuneSettings
from smajax.core.parameters import get_parameters, parameters
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System
from smajax.simulation.integration_error import IntegrationError

LEAST_LOOPS = 8
DRAWN = 8  # plants never seen that are drawn over time


@dataclass(frozen=True)
class Check:
    """Figures before and after on some closed loops: `seen` has two candidates, the preset's gains and the tuned ones."""

    scenarios: Scenarios
    seen: Evaluation


@dataclass(frozen=True)
class Lines:
    """Positions over time, before and after: (2, loops, time), rad or m; the loops of the plant as believed come first."""

    time: np.ndarray
    angles: np.ndarray
    targets: np.ndarray  # (loops,)


@dataclass(frozen=True)
class TuningResult:
    """What came of a tuning."""

    settings: TuneSettings
    before: Mapping[str, float]
    after: Gains
    box: Mapping[str, tuple[float, float]]
    units: Mapping[str, str]  # of the gains and of the parameters that were not tuned
    checks: Mapping[str, Check]  # `tuned on`, `inside`, `beyond`
    costs: tuple[float, float]  # before and after, on what was tuned on
    excesses: Mapping[str, tuple[float, float]]  # by which a limit is exceeded, of each check
    descent: MultistartState
    evolution: CmaEsState
    simulations: int  # closed loops of the search
    lines: Lines
    moves: Moves | None
    air: float  # degC, as the controller believes it
    plants: PlantSet  # what the columns of the scenarios mean
    largest: float  # command that the tuned controller may ask for, in the drive's unit; infinite where it does not say
    integration: IntegrationError  # what the integration leaves in the positions with the tuned gains

    @property
    def within_limits(self) -> bool:
        """Every limit is met, in what was tuned on and in plants inside of the variation that were never seen."""
        return self.excesses["tuned on"][1] <= 0.0 and self.excesses["inside"][1] <= 0.0


def problem_of(system: System, settings: TuneSettings, plants: PlantSet | None = None) -> TuningProblem:
    """The controller on its plant; batches no larger than a round needs. plants: by default the plant's mismatches."""
    plants = plant_set(system, None, tuple(settings.variation)) if plants is None else plants
    preset = CONTROLLERS[settings.controller]
    plant = preset.plant(system)
    if settings.fixed:
        preset = dataclasses.replace(preset, fixed=settings.fixed)
    size = settings.starts * tuned_on(settings.set_points, settings.variation, settings.seed, plants).size
    return TuningProblem(
        preset,
        system,
        box=settings.box or None,
        seconds=settings.seconds,
        interface=interface_of(
            plant, settings.estimator, settings.noise, settings.period, STEP, settings.delay, settings.quantum
        ),
        seed=settings.seed,
        loops=int(np.clip(1 << (size - 1).bit_length(), LEAST_LOOPS, LOOPS)),
        plants=plants,
    )


def tune(
    system: System,
    settings: TuneSettings,
    *,
    plants: Plants | None = None,
    after: MultistartState | None = None,
    known: CmaEsState | None = None,
    save: Callable[[MultistartState | CmaEsState], object] = lambda state: None,
    progress: Progress = quiet,
) -> TuningResult:
    """Tune from the preset's gains and the best of points of the box; `save` gets the state after every round.

    system: any load that moves, with any wire law and effects; `settings_for` has its set points and weights. plants: a batch of
    plants (`plants.Plants`), such as draws from a posterior, in the place of a variation: gains are tuned on three of every
    four and checked on the others.
    after, known: states of an interrupted tuning, of the gradient search and of CMA-ES; it resumes to the same end.

    Raises ValueError for settings that make no sense, MissingExtraError without a package that they need.
    """
    found, system = settings.check(system, plants), carrying(system, plants)
    settings.check_packages()
    scenarios = tuned_on(settings.set_points, settings.variation, settings.seed, found)
    task = SearchTask(problem_of(system, settings, found), settings.goal, scenarios)
    problem, name = task.problem, f"tuning {settings.controller}"
    _integrated(problem, settings, problem.controller, scenarios, STEP)
    descent = _by_gradient(task, settings, after, save, progress)
    progress(Stage("evaluating", 0.0))
    # Rounds evaluate at a coarse time step; of their results the best at a finer one is taken. The preset's gains and the
    # initial ones are among them.
    initial = (problem.point(settings.start),) if settings.start else ()
    best = _best_of(task, (problem.before, *initial, *descent.best))
    progress(Stage("evaluating", 1.0))
    evolution = evolve(
        task,
        problem.point(best),
        generations=settings.finish,
        seed=settings.seed,
        known=known,
        save=save,
        progress=progress,
        what=f"{name}, CMA-ES",
    )
    progress(Stage("evaluating", 0.0))
    best = _best_of(task, (problem.point(best), evolution.best))
    return _validated(task, settings, best, descent, evolution, progress)


def best_gains(
    system: System, settings: TuneSettings, candidates: Sequence[Gains], *, plants: Plants | None = None
) -> dict[str, float]:
    """Of gains that were found elsewhere, those that cost least on what these settings tune on; held in the box of this plant.

    Raises as `tune`.
    """
    found, system = settings.check(system, plants), carrying(system, plants)
    scenarios = tuned_on(settings.set_points, settings.variation, settings.seed, found)
    task = SearchTask(problem_of(system, settings, found), settings.goal, scenarios)
    _integrated(task.problem, settings, task.problem.controller, scenarios, STEP)
    return _best_of(task, [task.problem.point(one.values) for one in candidates])


def _by_gradient(
    task: SearchTask,
    settings: TuneSettings,
    after: MultistartState | None,
    save: Callable[[MultistartState], object],
    progress: Progress,
) -> MultistartState:
    """The end of the gradient search."""
    problem, effort, name = task.problem, settings.effort, f"tuning {settings.controller}"
    if after is None:
        progress(Stage(f"{name}: {settings.tried} points of the box", 0.0))
        first = problem.point(settings.start) if settings.start else problem.before
        state = begin(problem, task.goal, task.scenarios, effort, first)
        save(state)
        progress(Stage(f"{name}: {settings.tried} points of the box", 1.0))
    else:
        state, problem.simulations = after, after.simulations
    while not state.ended:
        progress(Stage(name, state.round / effort.rounds))
        state = next_round(problem, task.goal, task.scenarios, effort, state)
        save(state)
    progress(Stage(name, 1.0))
    return state


def _validated(
    task: SearchTask,
    settings: TuneSettings,
    best: Mapping[str, float],
    descent: MultistartState,
    evolution: CmaEsState,
    progress: Progress,
) -> TuningResult:
    """The result: both gains on the tuned and the held-out loops, over time, and in moves between set points."""
    problem, goal = task.problem, task.goal
    searched = problem.simulations
    pair = np.stack([problem.before, problem.point(best)])
    held = held_out(settings.set_points, settings.variation, settings.unseen, settings.seed, problem.plants)
    checks: dict[str, Check] = {}
    fixed = fixed_parameters(settings.controller, problem.controller)
    tuned = Gains(settings.controller, best, fixed, loop_settings(problem.system, settings))
    # What is small for the preset's gains need not be for those that were found.
    error = _integrated(problem, settings, tuned.put(problem.system), task.scenarios, FINE)
    for name, scenarios in {"tuned on": task.scenarios, **held}.items():
        checks[name] = Check(scenarios, problem.evaluate(pair, scenarios))
        progress(Stage("evaluating", len(checks) / (len(held) + 2)))
    cost = goal.cost(checks["tuned on"].seen.exact, task.scenarios)
    excesses = {name: goal.excess(one.seen.exact) for name, one in checks.items()}
    table = parameters(problem.controller)
    lines = _lines(problem, settings, tuned, held["inside"])
    moves = moved(problem, (problem.controller, tuned.put(problem.system)), settings.set_points)
    progress(Stage("evaluating", 1.0))
    preset = np.asarray(get_parameters(problem.controller, problem.names)).tolist()
    return TuningResult(
        settings=settings,
        before=dict(zip(problem.names, preset, strict=True)),
        after=tuned,
        box=problem.box,
        units={name: unit_on(table[name].unit, problem.system) for name in (*problem.names, *fixed)},
        checks=checks,
        costs=(float(cost[0]), float(cost[1])),
        excesses={name: (float(one[0]), float(one[1])) for name, one in excesses.items()},
        descent=descent,
        evolution=evolution,
        simulations=searched,
        lines=lines,
        moves=moves,
        air=float(get_parameters(problem.system, [MISMATCHES["ambient"]])[0]),
        plants=problem.plants,
        largest=float(tuned.put(problem.system).largest_command()),
        integration=error,
    )


def loop_settings(system: System, settings: TuneSettings) -> LoopSettings:
    """What lies between plant and controller, as a file of gains has it."""
    sensor = [float(settings.shown.to_own(one)) for one in (settings.noise, settings.quantum)]
    return settings_of(system, LoopInUse(None, settings.period, settings.delay, settings.estimator), *sensor)


def _integrated(
    problem: TuningProblem,
    settings: TuneSettings,
    controller: AbstractController,
    scenarios: Scenarios,
    dt: float,
) -> IntegrationError:
    """Let `problem` integrate as the settings ask for, measured on loops of this controller; what is left in the positions."""
    every = problem.interface.every * round(STEP / dt)
    setup = LoopSetup(
        problem.system,
        controller,
        problem.preset.main_gain,
        settings.seconds,
        dt,
        dataclasses.replace(problem.interface, every=every),
        settings.seed,
        perturbation=problem.plants.perturbation,
    )
    rows = np.column_stack([scenarios.rows, np.ones(scenarios.size)])
    chosen, error = integrated_setup(setup, rows, settings.tolerance)
    problem.integration = chosen.integration
    return error


def _best_of(task: SearchTask, points: Sequence[np.ndarray]) -> dict[str, float]:
    """The gains of the best of points of the unit cube, rounded as a file holds them."""
    problem = task.problem
    ends = problem.rounded(np.stack(points))
    return problem.gains(ends[int(np.argmin(rank(*task.score(ends))))])


def _lines(problem: TuningProblem, settings: TuneSettings, tuned: Gains, inside: Scenarios) -> Lines:
    """The plant as believed and some of the plants never seen, at the set points tuned."""
    targets = settings.shown.to_own(settings.set_points)
    plants = np.unique(inside.rows[:, :-1], axis=0)[:DRAWN]
    plants = np.concatenate([problem.plants.nominal[None], plants])
    rows = np.column_stack([np.repeat(plants, len(targets), axis=0), np.tile(targets, len(plants))])
    rows = np.column_stack([rows, np.ones(len(rows))])
    setup = LoopSetup(
        system=problem.system,
        controller=problem.controller,
        main_gain=problem.preset.main_gain,
        seconds=settings.seconds,
        dt=STEP,
        interface=problem.interface,
        seed=settings.seed,
        integration=problem.integration,
        perturbation=problem.plants.perturbation,
    )
    angles = [
        positions(dataclasses.replace(setup, controller=controller), rows)
        for controller in (problem.controller, tuned.put(problem.system))
    ]
    time = np.arange(angles[0].shape[1]) * STEP
    return Lines(time, np.stack(angles), rows[:, -2])
