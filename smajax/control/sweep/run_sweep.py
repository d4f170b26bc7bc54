"""A sweep controller by controller: settings -> figures of merit on the grid, from a cache where they were computed before."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import Merit
from smajax.control.gains_file import Gains
from smajax.control.least_time import Distance, command_limit, distance
from smajax.control.mismatch import MISMATCHES, check_ratios_of, default_mismatches
from smajax.control.plants import Plants, PlantSet, carrying, plant_set
from smajax.control.position_unit import PositionUnit, check_unit, default_set_points, unit_named, unit_of
from smajax.control.presets import CONTROLLERS, check_controller, code_of_parts, controllers_for
from smajax.control.reference import clock
from smajax.control.scales import is_arm, seconds_for
from smajax.control.signal_path import between_in_words, check_interface, check_set_points, default_noise, interface_of
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops, integrated_setup, positions
from smajax.control.sweep.grid import LEAST, MOST, OF_ARM, PLANT, Grid, check_ratios, loop_rows, sweep_ratios
from smajax.control.sweep.least_times import LeastTimes, least_times_of
from smajax.core.files import json_line, writing
from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.core.progress import Event, Progress, Stage, quiet
from smajax.core.provenance import digest
from smajax.core.result_cache import arrays
from smajax.model.system import System
from smajax.simulation.integration_error import AUTO, Tolerance

LINES = (0.5, 0.8, 1.0, 1.25, 2.0)  # ratios of which the angle over time is stored, where they go from 0.5 to 2
LINE_TARGET = 40.0  # deg, of the arm
# What lies between plant and controller where nobody says another: a filter of noisy, counted readings, and a delay; or nothing.
FILTER, DELAY = "adaptive", 1
UNPERTURBED = 2**30  # number of the first loop on the unperturbed plant beside a batch
TRUE_STATE: Mapping[str, Any] = MappingProxyType({"estimator": "", "noise": 0.0, "quantum": 0.0, "delay": 0})
CACHED = f"finished/*-{'[0-9a-f]' * 16}.npz"  # files of the cache, below the folder of the sweep
WITH_LEAST_TIMES = "with least times"
SAVED_LEAST = ("least_", "own_least_")
FIELDS = tuple(field.name for field in dataclasses.fields(Merit))


@dataclass(frozen=True)
class SweepSettings:
    """A sweep; set points and noise in `unit`: degrees of an angle, millimetres of a length."""

    controllers: tuple[str, ...]
    first: str = "convection"
    second: str = "damping"  # "": over the first alone
    points: int = 15
    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 10.0, 20.0, 40.0, 50.0, 60.0, 80.0)
    gain_ratios: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)  # times the controller's main gain
    seconds: float = 10.0
    dt: float = 0.01
    estimator: str = FILTER  # the filter that estimates the state; "": the controllers get the true state
    noise: float = 0.1  # standard deviation of the readings
    quantum: float = 0.1  # between two values of the readings
    period: float = 0.01  # s, sample time of the controller, a whole number of `dt`
    delay: int = DELAY  # control periods until a command reaches the amplifier
    tuned: tuple[Gains, ...] = ()  # in place of the presets'
    tolerance: Tolerance = AUTO  # as `run_batch`'s; None is one step a sample
    unit: str = "deg"  # of set points and noise, as `position_unit.unit_of` the plant
    ratio_range: tuple[float, float] = (LEAST, MOST)  # of plant over the controller's model: below and above 1
    seed: int = 0  # of the noise: each loop draws its own from it

    @property
    def grid(self) -> Grid:
        """On the arm. Raises ValueError as `Grid` does."""
        return self.grid_on(OF_ARM)

    def grid_on(self, plants: PlantSet) -> Grid:
        """On the mismatches of a plant or a batch of plants. Raises ValueError as `Grid` does."""
        targets, gains = unit_named(self.unit).to_own(self.set_points), np.asarray(self.gain_ratios)
        if plants.batch is not None:
            return Grid(PLANT, "", 1.0 + np.arange(len(plants.batch)), targets, gains, plants)
        return Grid(self.first, self.second, sweep_ratios(self.points, *self.ratio_range), targets, gains, plants)

    @property
    def mismatches(self) -> tuple[str, ...]:
        """The names that are swept over."""
        return tuple(name for name in (self.first, self.second) if name)

    @property
    def line_ratios(self) -> tuple[float, ...]:
        """Plant over model of the lines: `LINES`, or as far between 1 and the ends of another range."""
        ends = [self.ratio_range[0] if ratio < 1.0 else self.ratio_range[1] for ratio in LINES]
        shares = [abs(math.log2(ratio)) for ratio in LINES]
        return tuple(round(end**share, 3) for end, share in zip(ends, shares, strict=True))

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return json.loads(
            json.dumps({**vars(self), "tuned": [dataclasses.asdict(one) for one in self.tuned]}, default=dict)
        )

    @property
    def between(self) -> str:
        """The interface between plant and controller, in words."""
        files = ", ".join(f"{one.controller} has gains from a file" for one in self.tuned)
        unit = unit_named(self.unit)
        words = between_in_words(self.estimator, self.noise, self.period, self.delay, unit, self.quantum)
        return f"{words} {files}." if files else words

    def check(self, system: System, plants: Plants | None = None) -> PlantSet:
        """The plants, if all is well: ValueError for names that do not exist and values that make no sense."""
        for name in self.controllers:
            check_controller(name, system)
        if not self.controllers:
            raise ValueError(f"no controller is named, expected some of {', '.join(CONTROLLERS)}.")
        check_unit(system, unit_named(self.unit, unit_of(system).command))
        check_set_points(system, self.set_points)
        if not self.gain_ratios or min(self.gain_ratios) <= 0.0:
            raise ValueError(
                f"ratios of the main gain are numbers above 0, at least one; not {', '.join(map(str, self.gain_ratios))}."
            )
        check_ratios(*self.ratio_range)
        check_interface(self.estimator, self.noise, self.period, self.dt, self.quantum)
        unused = [gains.controller for gains in self.tuned if gains.controller not in self.controllers]
        if unused:
            raise ValueError(
                f"gains are given for {', '.join(unused)}, and only {', '.join(self.controllers)} are swept."
            )
        found = plant_set(system, plants, self.mismatches)
        _ = self.grid_on(found)  # it checks itself
        if found.batch is None:
            check_ratios_of(system, dict.fromkeys(self.mismatches, self.ratio_range), found.table)
        return found


def sweep_settings_for(system: System, controllers: Sequence[str] | None = None, **given: Any) -> SweepSettings:
    """A sweep on any plant: what is not given is the arm's, or that of the load's unit, stroke, time and mismatches.

    controllers: by default all that this plant gives what they need. given: fields of `SweepSettings`. With `estimator=""` the rest of
    what lies between is by default as in `TRUE_STATE`; with a noise and no quantum the readings have no steps.
    """
    defaults: dict[str, Any] = {"unit": unit_of(system).shown, "seconds": seconds_for(system)}
    defaults["first"], defaults["second"] = default_mismatches(system)
    if given.get("estimator", FILTER):
        sigma = default_noise(system)
        defaults |= {"noise": sigma, "quantum": 0.0 if "noise" in given else sigma}
    else:
        defaults |= TRUE_STATE
    if not is_arm(system):
        defaults["set_points"] = default_set_points(system)
    return SweepSettings(
        tuple(controllers_for(system) if controllers is None else controllers), **{**defaults, **given}
    )


@dataclass(frozen=True)
class ControllerSweep:
    """One controller: figures of merit and failures on the grid, angles over time by mismatch, and the unperturbed plant."""

    name: str
    main_gain: str
    merits: Merit  # arrays of the grid's shape
    failed_at: np.ndarray  # s, of the grid's shape; infinity where no loop failed
    lines: Mapping[str, np.ndarray]  # mismatch -> (len(LINES), time), rad or m, at `line_target`; of a batch: none
    nominal: Merit  # of the unperturbed plant, arrays (set points,)
    integration_error: Mapping[str, Any]  # what the integration leaves in the positions, as `IntegrationError.record`
    least: LeastTimes  # with the largest command of all controllers of the sweep that say theirs: the same for all these on the same plant
    own_least: LeastTimes  # with that of the controller
    says_limit: bool = (
        True  # whether the controller says its largest command; else both are with the drive's, if that is larger
    )

    def nominal_distance(self, least: LeastTimes) -> Distance | None:
        """From these least times, on the unperturbed plant. None where the command has no limit, and so no time is the least."""
        if not math.isfinite(least.limit):
            return None
        return distance(np.asarray(self.nominal.settling_time), least.nominal)

    def distance_at(self, gain: int, least: LeastTimes) -> Distance | None:
        """The same on all plants of the grid at one ratio of the main gain, by its index."""
        if not math.isfinite(least.limit):
            return None
        return distance(np.asarray(self.merits.settling_time)[..., gain], least.grid)


@dataclass(frozen=True)
class SweepResults:
    """All controllers of a sweep that are finished, what they were run with, and the air's temperature (degC) that they assume."""

    settings: SweepSettings
    sweeps: tuple[ControllerSweep, ...]
    air: float
    line_target: float  # rad or m, set point of the lines
    plants: PlantSet = OF_ARM

    @cached_property
    def grid(self) -> Grid:
        """Of its loops."""
        return self.settings.grid_on(self.plants)

    @property
    def time(self) -> np.ndarray:
        """Of the lines, s."""
        return np.asarray(clock(self.settings.seconds, self.settings.dt))

    @property
    def unit(self) -> PositionUnit:
        """Of angles or lengths, as shown."""
        return self.plants.unit

    @property
    def nominal(self) -> dict[str, Merit]:
        """Figures of merit on the unperturbed plant by controller."""
        return {one.name: one.nominal for one in self.sweeps}


def assumed_air(system: System) -> float:
    """The air's temperature that controllers assume, degC."""
    return float(get_parameters(system, [MISMATCHES["ambient"]])[0])


def begun_sweep(system: System, settings: SweepSettings, plants: Plants | None = None) -> SweepResults:
    """A sweep of which no controller is finished. Raises ValueError as `SweepSettings.grid_on`."""
    found = plant_set(system, plants, settings.mismatches)
    target = line_target(system, settings.grid_on(found))
    return SweepResults(settings, (), assumed_air(system), target, found)


def line_target(system: System, grid: Grid) -> float:
    """The set point (rad, m) of the lines: 40 degrees of the arm, of another load the middle one of the sweep's."""
    if is_arm(system):
        return float(np.radians(LINE_TARGET))
    return float(np.sort(grid.targets)[len(grid.targets) // 2])


def may_resume(before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether a sweep recorded as `now` continues one recorded as `before`: the same, or with controllers added."""
    before = {"seed": 0, **before}  # of a record of before there was one
    added = {"controllers", "tuned"}
    gains = [one for one in now["tuned"] if one["controller"] in before["controllers"]]
    return (
        {key: value for key, value in before.items() if key not in added}
        == {key: value for key, value in now.items() if key not in added}
        and set(before["controllers"]) <= set(now["controllers"])
        and gains == before["tuned"]
    )


def sweep_controllers(
    system: System,
    settings: SweepSettings,
    folder: Path | None = None,
    progress: Progress = quiet,
    plants: Plants | None = None,
) -> Iterator[ControllerSweep]:
    """The controllers one after the other; `folder` has the cache of those that are finished (`CACHED`).

    system: any load that moves, which the controllers assume. plants: a batch of plants (`plants.Plants`), such as draws from a
    posterior, in the place of mismatches. Raises ValueError as `SweepSettings.check`.
    """
    found, system = settings.check(system, plants), carrying(system, plants)
    limits = {name: _limit(system, name, settings) for name in settings.controllers}
    # One that says none may be given the drive's, hundreds of volts: it has no part in the least times of the others.
    said = max((one.largest for one in limits.values() if one.said), default=0.0)
    shared = {name: one._replace(largest=said if one.said else max(said, one.largest)) for name, one in limits.items()}
    return (_sweep(system, name, settings, found, folder, progress, shared[name]) for name in settings.controllers)


class _Limit(NamedTuple):
    largest: float  # command, in the drive's unit
    said: bool  # whether the controller says its own; else it is the drive's


def _sweep(
    system: System,
    name: str,
    settings: SweepSettings,
    plants: PlantSet,
    folder: Path | None,
    progress: Progress,
    shared: _Limit,
) -> ControllerSweep:
    """shared: the largest command of all controllers of the sweep, and of this one where it says none."""
    preset = CONTROLLERS[name]
    tuned = tuple(gains for gains in settings.tuned if gains.controller == name)
    # What an older version cached has no least times.
    key = digest(
        _plant_and_controller(system, name, settings),
        [
            code_of_parts(name, settings.estimator),
            f"{WITH_LEAST_TIMES} {shared.largest:g}",
            str(dataclasses.replace(settings, controllers=(name,), tuned=tuned)),
            *plants.marks,
        ],
    )[:16]
    file = None if folder is None else folder / "finished" / f"{name}-{key}.npz"
    saved: dict[str, Any] | None = None if file is None else arrays(file)
    if saved is None:
        saved = _computed(system, name, settings, plants, progress, shared.largest)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            with writing(file) as stream:
                np.savez(stream, **saved)
    least, own_least = (
        LeastTimes(float(saved[f"{of}limit"]), saved[f"{of}grid"], saved[f"{of}nominal"]) for of in SAVED_LEAST
    )
    return ControllerSweep(
        name,
        preset.main_gain,
        Merit(**{field: saved[f"grid_{field}"] for field in FIELDS}),
        saved["failed"],
        {mismatch: saved[f"line_{mismatch}"] for mismatch in _lined(plants)},
        Merit(**{field: saved[f"nominal_{field}"] for field in FIELDS}),
        json.loads(str(saved["integration_error"])),
        least,
        own_least,
        shared.said,
    )


def _lined(plants: PlantSet) -> tuple[str, ...]:
    """The mismatches of the lines."""
    return plants.columns if plants.batch is None else ()


def _plant_and_controller(system: System, name: str, settings: SweepSettings) -> tuple[System, AbstractController]:
    """The plant of the controller's section, and the controller with its gains."""
    plant, tuned = CONTROLLERS[name].plant(system), [one for one in settings.tuned if one.controller == name]
    return plant, tuned[-1].put(plant) if tuned else CONTROLLERS[name].make(plant)


def _limit(system: System, name: str, settings: SweepSettings) -> _Limit:
    """Largest command of a controller; of one whose main gain is that limit at the ratio nearest to 1, of which distances are told."""
    plant, controller = _plant_and_controller(system, name, settings)
    gain = CONTROLLERS[name].main_gain
    if parameters(controller)[gain].limits_command:
        ratio = min(settings.gain_ratios, key=lambda one: abs(one - 1.0))
        (limit,) = get_parameters(controller, [gain])
        controller = set_parameters(controller, {gain: max(1.0, ratio) * float(limit)})
    return _Limit(command_limit(plant, controller), math.isfinite(float(controller.largest_command())))


def _computed(
    system: System, name: str, settings: SweepSettings, plants: PlantSet, progress: Progress, shared: float
) -> dict[str, Any]:
    """Arrays by name: the grid, the unperturbed plant at every set point, and the lines."""

    def relabelled(event: Event) -> None:
        progress(dataclasses.replace(event, name=f"sweeping {name}") if isinstance(event, Stage) else event)

    preset, grid, lined = CONTROLLERS[name], settings.grid_on(plants), _lined(plants)
    plant, controller = _plant_and_controller(system, name, settings)
    between = settings.estimator, settings.noise, settings.period, settings.dt
    setup = LoopSetup(
        plant,
        controller,
        preset.main_gain,
        settings.seconds,
        settings.dt,
        interface_of(plant, *between, settings.delay, settings.quantum),
        perturbation=plants.perturbation,
        seed=settings.seed,
    )
    # One batch, one program.
    whole = np.concatenate([grid.rows(), loop_rows({}, grid.targets, plants=plants)])
    setup, error = integrated_setup(setup, whole, settings.tolerance)
    # A loop draws its noise by its number: that of the unperturbed plant is not to go by how many plants a batch has.
    numbers = np.arange(len(whole))
    if grid.numbered:
        numbers[grid.size :] += UNPERTURBED - grid.size
    outcome = closed_loops(setup, whole, relabelled, numbers)
    angles: Sequence[np.ndarray] = ()
    if lined:
        target = line_target(plant, grid)
        ratios = np.asarray(settings.line_ratios)
        rows = np.concatenate([loop_rows({one: ratios}, target, plants=plants) for one in lined])
        angles = list(positions(setup, rows).reshape(len(lined), len(LINES), -1))
    inside, nominal = slice(grid.size), grid.size + np.arange(len(grid.targets))
    result: dict[str, Any] = {"failed": outcome.failed_at[inside].reshape(grid.shape)}
    result["integration_error"] = np.asarray(json_line(error.record()))
    both = least_times_of(setup, grid, [shared, _limit(system, name, settings).largest])
    for of, least in zip(SAVED_LEAST, both, strict=True):
        result |= {f"{of}{name}": np.asarray(value) for name, value in least._asdict().items()}
    for field in FIELDS:
        values = np.asarray(getattr(outcome.merits, field))
        result[f"grid_{field}"], result[f"nominal_{field}"] = values[inside].reshape(grid.shape), values[nominal]
    return result | {f"line_{mismatch}": line for mismatch, line in zip(lined, angles, strict=True)}
