"""A sweep controller by controller: settings -> figures of merit on the grid, from a cache where they were computed before."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from smajax.control.figures_of_merit import Merit
from smajax.control.gains_file import Gains
from smajax.control.interface import between_in_words, check_interface, check_set_points, interface_of
from smajax.control.mismatch import MISMATCHES
from smajax.control.presets import CONTROLLERS
from smajax.control.sweep.batched_loops import LoopSetup, closed_loops, integrated_setup, positions
from smajax.control.sweep.grid import Grid, loop_rows, sweep_ratios
from smajax.core.files import json_line, writing
from smajax.core.names import close_matches
from smajax.core.parameters import get_parameters
from smajax.core.progress import Event, Progress, Stage, quiet
from smajax.core.provenance import digest
from smajax.core.result_cache import arrays
from smajax.model.system import System
from smajax.simulation.integration_error import AUTO, Tolerance

LINES = (0.5, 0.8, 1.0, 1.25, 2.0)  # ratios of which the angle over time is stored
LINE_TARGET = 40.0  # deg
CACHED = f"finished/*-{'[0-9a-f]' * 16}.npz"  # files of the cache, below the folder of the sweep
FIELDS = tuple(field.name for field in dataclasses.fields(Merit))


@dataclass(frozen=True)
class SweepSettings:
    """A sweep; angles in degrees."""

    controllers: tuple[str, ...]
    first: str = "convection"
    second: str = "damping"  # "": over the first alone
    points: int = 15
    set_points: tuple[float, ...] = (-40.0, -20.0, 0.0, 10.0, 20.0, 40.0, 50.0, 60.0, 80.0)
    gain_ratios: tuple[float, ...] = (0.5, 0.7, 1.0, 1.4, 2.0)  # times the controller's main gain
    seconds: float = 10.0
    dt: float = 0.01
    estimator: str = ""  # the filter that estimates the state; "": the controllers get the true state
    noise: float = 0.0  # degrees, standard deviation of the angle's readings
    period: float = 0.01  # s, sample time of the controller, a whole number of `dt`
    delay: int = 0  # control periods until a command reaches the amplifier
    tuned: tuple[Gains, ...] = ()  # in place of the presets'
    tolerance: Tolerance = AUTO  # as `run_batch`'s; None is one step a sample

    @property
    def grid(self) -> Grid:
        """Raises ValueError as `Grid` does."""
        targets = np.radians(self.set_points)
        return Grid(self.first, self.second, sweep_ratios(self.points), targets, np.asarray(self.gain_ratios))

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return json.loads(json.dumps({**vars(self), "tuned": [vars(one) for one in self.tuned]}, default=dict))

    @property
    def between(self) -> str:
        """The interface between plant and controller, in words."""
        files = ", ".join(f"{one.controller} has gains from a file" for one in self.tuned)
        words = between_in_words(self.estimator, self.noise, self.period, self.delay)
        return f"{words} {files}." if files else words

    def check(self, system: System) -> None:
        """Raise ValueError for names that do not exist and values that make no sense."""
        for name in self.controllers:
            if name not in CONTROLLERS:
                raise ValueError(f"no controller `{name}`{close_matches(name, CONTROLLERS, 'there are')}.")
        if not self.controllers:
            raise ValueError(f"no controller is named, expected some of {', '.join(CONTROLLERS)}.")
        check_set_points(system, self.set_points)
        if not self.gain_ratios or min(self.gain_ratios) <= 0.0:
            raise ValueError(
                f"ratios of the main gain are numbers above 0, at least one; not {', '.join(map(str, self.gain_ratios))}."
            )
        check_interface(self.estimator, self.noise, self.period, self.dt)
        unused = [gains.controller for gains in self.tuned if gains.controller not in self.controllers]
        if unused:
            raise ValueError(
                f"gains are given for {', '.join(unused)}, and only {', '.join(self.controllers)} are swept."
            )
        _ = self.grid  # it checks itself


@dataclass(frozen=True)
class ControllerSweep:
    """One controller: figures of merit and failures on the grid, angles over time by mismatch, and the unperturbed plant."""

    name: str
    main_gain: str
    merits: Merit  # arrays of the grid's shape
    failed_at: np.ndarray  # s, of the grid's shape; infinity where no loop failed
    lines: Mapping[str, np.ndarray]  # mismatch -> (len(LINES), time), rad, at the set point LINE_TARGET
    nominal: Merit  # of the unperturbed plant, arrays (set points,)
    integration_error: Mapping[str, Any]  # what the integration leaves in the positions, as `IntegrationError.record`


@dataclass(frozen=True)
class SweepResults:
    """All controllers of a sweep, what they were run with, and the air's temperature (degC) that they assume."""

    settings: SweepSettings
    sweeps: tuple[ControllerSweep, ...]
    air: float

    @property
    def nominal(self) -> dict[str, Merit]:
        """Figures of merit on the unperturbed plant by controller."""
        return {one.name: one.nominal for one in self.sweeps}


def assumed_air(system: System) -> float:
    """The air's temperature that controllers assume, degC."""
    return float(get_parameters(system, [MISMATCHES["ambient"]])[0])


def may_resume(before: Mapping[str, Any], now: Mapping[str, Any]) -> bool:
    """Whether a sweep recorded as `now` continues one recorded as `before`: the same, or with controllers added."""
    added = {"controllers", "tuned"}
    gains = [one for one in now["tuned"] if one["controller"] in before["controllers"]]
    return (
        {key: value for key, value in before.items() if key not in added}
        == {key: value for key, value in now.items() if key not in added}
        and set(before["controllers"]) <= set(now["controllers"])
        and gains == before["tuned"]
    )


def sweep_controllers(
    system: System, settings: SweepSettings, folder: Path | None = None, progress: Progress = quiet
) -> Iterator[ControllerSweep]:
    """The controllers one after the other; `folder` has the cache of those that are finished (`CACHED`).

    Raises ValueError as `SweepSettings.check`.
    """
    settings.check(system)
    return (_sweep(system, name, settings, folder, progress) for name in settings.controllers)


def _sweep(
    system: System, name: str, settings: SweepSettings, folder: Path | None, progress: Progress
) -> ControllerSweep:
    preset = CONTROLLERS[name]
    plant = preset.plant(system)
    tuned = tuple(gains for gains in settings.tuned if gains.controller == name)
    key = digest(plant, [str(dataclasses.replace(settings, controllers=(name,), tuned=tuned))])[:16]
    file = None if folder is None else folder / "finished" / f"{name}-{key}.npz"
    saved: dict[str, Any] | None = None if file is None else arrays(file)
    if saved is None:
        saved = _computed(plant, name, settings, progress)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            with writing(file) as stream:
                np.savez(stream, **saved)
    return ControllerSweep(
        name,
        preset.main_gain,
        Merit(**{field: saved[f"grid_{field}"] for field in FIELDS}),
        saved["failed"],
        {mismatch: saved[f"line_{mismatch}"] for mismatch in MISMATCHES},
        Merit(**{field: saved[f"nominal_{field}"] for field in FIELDS}),
        json.loads(str(saved["integration_error"])),
    )


def _computed(plant: System, name: str, settings: SweepSettings, progress: Progress) -> dict[str, Any]:
    """Arrays by name: the grid, the unperturbed plant at every set point, and the lines."""

    def relabelled(event: Event) -> None:
        progress(dataclasses.replace(event, name=f"sweeping {name}") if isinstance(event, Stage) else event)

    preset, grid = CONTROLLERS[name], settings.grid
    tuned = [gains for gains in settings.tuned if gains.controller == name]
    setup = LoopSetup(
        plant,
        tuned[-1].put(plant) if tuned else preset.make(plant),
        preset.main_gain,
        settings.seconds,
        settings.dt,
        interface_of(plant, settings.estimator, settings.noise, settings.period, settings.dt, settings.delay),
    )
    # One batch, one program.
    whole = np.concatenate([grid.rows(), loop_rows({}, grid.targets)])
    setup, error = integrated_setup(setup, whole, settings.tolerance)
    outcome = closed_loops(setup, whole, relabelled)
    target = float(np.radians(LINE_TARGET))
    rows = np.concatenate([loop_rows({one: np.asarray(LINES)}, target) for one in MISMATCHES])
    angles = positions(setup, rows).reshape(len(MISMATCHES), len(LINES), -1)
    inside, nominal = slice(grid.size), grid.size + np.arange(len(grid.targets))
    result: dict[str, Any] = {"failed": outcome.failed_at[inside].reshape(grid.shape)}
    result["integration_error"] = np.asarray(json_line(error.record()))
    for field in FIELDS:
        values = np.asarray(getattr(outcome.merits, field))
        result[f"grid_{field}"], result[f"nominal_{field}"] = values[inside].reshape(grid.shape), values[nominal]
    return result | {f"line_{mismatch}": line for mismatch, line in zip(MISMATCHES, angles, strict=True)}
