"""One run from a request in names and text: presets, values, inputs -> data set, figures of merit, notes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from smajax.control.closed_loop import ClosedLoopSetup, check_answers
from smajax.control.compiled_loop import measured_loop
from smajax.control.compose import compose, with_values
from smajax.control.figures_of_merit import SetPointMerit, merit_by_set_point, set_point_spans
from smajax.control.found_notes import (
    notes_of_cycle,
    notes_of_length,
    notes_of_reach,
    notes_of_run,
    notes_of_set_points,
)
from smajax.control.gains_file import Gains, read_gains
from smajax.control.loop_dataset import labelled_loop
from smajax.control.loop_settings import LoopInUse, LoopSettings, joined, settings_of
from smajax.control.model_as_plant import (
    gives_limit,
    input_lag_left_out,
    noise_of_file,
    plant_of,
    true_plant,
    with_limit,
)
from smajax.control.position_unit import PositionUnit, unit_of
from smajax.control.presets import CONTROLLERS, check_controller
from smajax.control.reference import Reference
from smajax.control.reference_file import reference_of
from smajax.control.run_notes import (
    MOST_SET_POINTS,
    InputLeftOut,
    LimitOfFitRuns,
    NoiseOfModelFile,
    PresetGains,
    Source,
    StraightLines,
    TooManySetPoints,
    gains_of_files,
    voltages_of_limit,
)
from smajax.control.run_result import RunResult, mismatches
from smajax.control.scales import is_arm
from smajax.control.signal_path import between_in_words, check_interface, interface_of, noise_of
from smajax.core.names import close_matches
from smajax.core.parameters import parameter_values
from smajax.core.wording import and_listed
from smajax.data.model_file.record import ModelRecord
from smajax.data.text_input import clock_of, given, length_of, reads_file
from smajax.model.channels import INPUT_UNITS, REPLACED
from smajax.model.extended import without_input_lag
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System
from smajax.simulation.dataset import simulate_dataset
from smajax.simulation.integration_error import AUTO, Tolerance
from smajax.simulation.simulate import DEFAULT_STEP


class RequestError(ValueError):
    """A part of a request cannot be used. part: the field of `RunRequest` or `LoopRequest`; of an input `inputs.` and its name."""

    def __init__(self, part: str, why: str) -> None:
        super().__init__(why)
        self.part = part


@contextmanager
def _part(name: str) -> Iterator[None]:
    """A ValueError in this context becomes a RequestError of this part."""
    try:
        yield
    except ValueError as error:
        raise RequestError(name, str(error)) from error


@dataclass(frozen=True)
class RunRequest:
    """A run: presets by name or a model file, values that differ, inputs as text (`text_input.given`), and the step, s."""

    wire: str = "niti_table_3_1"
    load: str = "arm"
    drive: str = "amplified_voltage"
    law: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    time: str = ""  # the time column of files
    seconds: float | None = None
    dt: float = DEFAULT_STEP
    tolerance: Tolerance = AUTO  # as `simulate_dataset`'s
    model: ModelRecord | None = None  # a model file, in the place of the presets
    measured: Mapping[str, str] = field(
        default_factory=dict
    )  # sensor -> FILE:COLUMN:UNIT of a log to hold the run against

    def system(self) -> System:
        """The model. Raises KeyError and ValueError as `compose`, RequestError of `values`."""
        bare = compose(self.wire, self.load, self.drive, law=self.law) if self.model is None else self.model.system
        with _part("values"):
            return with_values(bare, self.values)

    def plant(self, limit: float | None = None) -> tuple[System, LimitOfFitRuns | None]:
        """(the model of a closed loop, whose command has this limit; that of the model file's runs, where it holds). Raises as `system`.

        A limit among the `values` goes first.
        """
        if self.model is None:
            system = self.system()
            return system if gives_limit(self.values) else with_limit(system, limit), None
        with _part("values"):
            return plant_of(self.model, self.values, limit)

    def inputs_left_out(self) -> list[InputLeftOut]:
        """Each input that the logs of a kept model had, and that this run leaves to a parameter."""
        if self.model is None:
            return []
        kept = self.model
        replaced = {channel: name for name, channel in REPLACED.items()}
        return [
            InputLeftOut(channel, INPUT_UNITS[channel], (low, high), replaced[channel], kept.values[replaced[channel]])
            for channel, (low, high) in kept.fitted_range.items()
            if channel in replaced
            and channel not in self.inputs
            and not {channel, replaced[channel]} & self.values.keys()
        ]


@dataclass(frozen=True)
class LoopRequest:
    """A closed loop around the model of a `RunRequest`.

    What is None is that of the file of gains; without one the noise is that of the model file's sensor, the period 10 ms, and there is neither
    delay nor filter.
    """

    controller: str
    set_points: str  # levels: `40deg:5s,10deg:5s`, of a length `3mm:10s`, or of a file `FILE:COLUMN:UNIT`, `FILE:COLUMN:UNIT:held`
    gains: Path | None = None
    # Values of the plant that the controller does not assume, or changes of what it assumes: `+20%`.
    mismatch: Mapping[str, str] = field(default_factory=dict)
    estimator: str | None = None  # "": the true state
    noise: float | str | None = None  # degrees or millimetres, or text with a unit
    quantum: float | str = 0.0  # step between two readings, as the noise; 0: none
    period: float | None = None  # s
    delay: int | None = None  # periods
    seed: int = 0
    plant: ModelRecord | None = None  # the plant that runs, where it is another model than the controller's

    @property
    def given(self) -> LoopSettings:
        """What options say of the loop."""
        return LoopSettings(period=self.period, delay=self.delay, estimator=self.estimator)


def channels(system: System) -> tuple[frozenset[str], frozenset[str]]:
    """(inputs that the model needs, inputs that it may have besides)."""
    required = system.load.inputs_required | system.drive.inputs_required
    return required, (system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"}) - required


def _unit(name: str) -> str:
    return "N m" if name == "load_torque" else INPUT_UNITS[name]


def _check_inputs(request: RunRequest, required: frozenset[str], optional: frozenset[str]) -> None:
    """RequestError for an input that the model does not take, ValueError for one that is missing."""
    for name in request.inputs:
        if name not in required | optional:
            known = sorted(required | optional)
            raise RequestError(f"inputs.{name}", f"no input {name!r}{close_matches(name, known, 'this model takes')}")
    missing = sorted(required - request.inputs.keys())
    if missing:
        step = "--step LEVEL:TIME,LEVEL:TIME or " if len(required) == 1 else ""
        options = [f"--input {name}={'6V' if name == 'voltage' else 'LEVEL'}:10s" for name in missing]
        named = and_listed([repr(name) for name in missing])
        raise ValueError(
            f"the model needs the input{'s' * (len(missing) > 1)} {named}: give {step}{' '.join(options)} (a file: {missing[0]}=log.csv:COLUMN)"
        )


def run_open(request: RunRequest) -> RunResult:
    """The run. Raises KeyError and ValueError for a request that cannot be used, RequestError where its wrong part is known."""
    system = request.system()
    _check_inputs(request, *channels(system))
    several = {}
    for name, text in request.inputs.items():
        with _part(f"inputs.{name}"):
            several[name] = given(text, _unit(name), request.time, bare=_unit(name))
    clock = clock_of(list(several.values()), request.seconds, request.dt)
    measured = system.load.inputs_required if isinstance(system.load, AbstractCoupon) else frozenset()
    series: Any = {
        name: one.on(clock, request.dt, squared=name in system.drive.inputs_squared, sampled=name in measured)
        for name, one in several.items()
    }
    left_out = request.inputs_left_out()
    data = simulate_dataset(system, series, request.dt, request.tolerance)
    data = data.assign_coords(time=data["time"].copy(data=clock))  # a sum of steps has rounding errors
    notes = [
        *left_out,
        *notes_of_length(length_of(list(several.values()), request.seconds), clock, request.dt),
        *notes_of_run(data),
        *notes_of_cycle(system, data),
    ]
    data = _with_measured(request, system, data)
    return RunResult(data, system, {}, tuple(notes))


def _with_measured(request: RunRequest, system: System, data: xr.Dataset) -> xr.Dataset:
    """`data` with the measured series that it is held against, each at the run's times, nan beyond the log's end."""
    sensors = {system.load.reading[0]: "reading", **{name: name for name in COMPARED if name in data}}
    for name, text in request.measured.items():
        with _part(f"measured.{name}"):
            if name not in sensors:
                raise ValueError(f"no sensor {name!r}{close_matches(name, sensors, 'a run may be held against')}")
            unit = data[sensors[name]].attrs["units"]
            own = "1" if unit == "-" else unit
            if not reads_file(text):
                raise ValueError(f"got {text!r}, expected a column of a log, such as log.csv:COLUMN:UNIT.")
            log = given(text, own, request.time, bare=own)
            clock = data["time"].to_numpy()
            values = np.interp(clock, log.time, log.values, right=np.nan)
            # At the log's own instants: between them its noise would be averaged.
            within = log.time <= clock[-1] + 1e-9
            error = log.values[within] - np.interp(log.time[within], clock, data[sensors[name]].to_numpy())
            figures = {"error_rms": float(np.sqrt(np.mean(error**2))), "error_rms_without_mean": float(np.std(error))}
            shown = {"units": unit, "of": sensors[name], **figures}
            data = data.assign({f"{MEASURED}{name}": ("time", values, shown)})
    return data


class _Assumed(NamedTuple):
    """What the controller is told: its model, its gains, the loop that it is in, and where these come from."""

    system: System
    gains: Gains
    loop: LoopInUse
    sensor: tuple[float, float]  # its noise, and the step between two readings, rad or m
    sources: tuple[Source, ...]


def _assumed(request: RunRequest, loop: LoopRequest) -> _Assumed:
    """Raises as `run_open`, and GainsFileError."""
    bare = request.system() if request.model is None else without_input_lag(request.system())
    gains = Gains(loop.controller, {}) if loop.gains is None else read_gains(loop.gains, bare)
    if gains.controller not in CONTROLLERS:
        raise ValueError(
            f"no controller {gains.controller!r}{close_matches(gains.controller, CONTROLLERS, 'there are')}"
        )
    check_controller(gains.controller, bare)
    gains = gains.without_limit(bare) if gives_limit(request.values) else gains
    merged = joined({gains.controller: gains.loop}, loop.given)
    system, limit = request.plant(merged.command_limit)
    system = CONTROLLERS[gains.controller].plant(system)
    with _part("noise"):
        noise, source = _noise(request, loop, system)
    with _part("quantum"):
        unit = unit_of(system)
        sensor = noise, float(unit.to_own(noise_of(loop.quantum, unit)))
    own = settings_of(system, merged, *sensor)
    of_gains = (
        [PresetGains(gains.controller, not is_arm(system)), *voltages_of_limit(system)]
        if loop.gains is None
        else gains_of_files([gains], system, loop.given, own)
    )
    sources = limit, source, *input_lag_left_out(request.model), *of_gains
    return _Assumed(system, gains, merged, sensor, tuple(one for one in sources if one is not None))


def _noise(request: RunRequest, loop: LoopRequest, system: System) -> tuple[float, NoiseOfModelFile | None]:
    """(standard deviation of the reading, rad or m; that of the plant's model file where it is that)."""
    if loop.noise is not None:
        unit = unit_of(system)
        return float(unit.to_own(noise_of(loop.noise, unit))), None
    model = request.model if loop.plant is None else loop.plant
    source = noise_of_file(model)
    return 0.0 if source is None else source.noise, source


class _Wanted(NamedTuple):
    """The set point over a whole number of control periods, (n,): times (s) and positions (rad or m)."""

    clock: np.ndarray
    reference: Reference
    straight: bool  # between rows of a file
    asked: float  # s: how long the run is to be


def _set_points(request: RunRequest, loop: LoopRequest, own: LoopInUse, every: int, unit: PositionUnit) -> _Wanted:
    with _part("set_points"):
        levels = given(loop.set_points, unit.own, request.time, bare=unit.shown)
    clock = clock_of([levels], request.seconds, request.dt)
    periods = (clock.size - 1) // every
    if periods < 1:
        raise ValueError(f"the run is shorter than one control period of {own.period:g} s.")
    clock = clock[: periods * every + 1]
    reference = reference_of(levels, clock, request.dt)
    return _Wanted(clock, reference, levels.measured, length_of([levels], request.seconds))


def _tracking_error(error: np.ndarray) -> dict[str, float]:
    """Root mean square of `error`, (n,), as `RunResult.tracking_error`."""
    parts = {"whole_run": error, "second_half": error[error.size // 2 :]}
    return {name: float(np.sqrt(np.mean(part**2))) for name, part in parts.items()}


COMPARED = ("temperature", "stress", "strain")  # beside the load's own reading
MEASURED = "measured_"  # before the name of a sensor: the variable of its log


def run_closed(request: RunRequest, loop: LoopRequest) -> RunResult:
    """The closed loop. Raises as `run_open`, and GainsFileError."""
    assumed, gains, own, sensor, sources = _assumed(request, loop)
    with _part("mismatch" if loop.plant is None else "plant"):
        plant = (
            with_values(assumed, loop.mismatch)
            if loop.plant is None
            else true_plant(loop.plant, loop.mismatch, assumed, gains.controller)
        )
    unit = unit_of(assumed)
    sigma, quantum = (float(unit.of(one)) for one in sensor)
    between = own.estimator, sigma, own.period
    check_interface(*between, request.dt, quantum)
    interface = interface_of(assumed, *between, request.dt, own.delay, quantum)
    clock, wanted, straight, asked = _set_points(request, loop, own, interface.every, unit)
    position = np.asarray(wanted.position)
    controller = gains.put(assumed)
    setup = ClosedLoopSetup(
        plant,
        controller,
        wanted,
        request.dt,
        interface.every,
        estimator=interface.estimator,
        sensor=interface.sensor,
        key=None if interface.sensor is None else jax.random.key(loop.seed),
        delay=interface.delay,
        assumed=assumed,
    )
    run, merits, error = measured_loop(setup, request.tolerance)
    # As in `run_open`.
    run = eqx.tree_at(lambda one: one.run.time, run, jnp.asarray(clock))
    data = labelled_loop(
        plant,
        run,
        error,
        estimated=interface.estimator is not None,
        dt=request.dt,
        controller=gains.controller,
        gains=parameter_values(controller),
        between=between_in_words(*between, own.delay, unit, quantum),
    )
    notes = [*notes_of_length(asked, clock, request.dt * interface.every), *notes_of_run(data)]
    # A log is held against the state of the plant: the noise of the loop's sensor is none of the model.
    state = data.assign(reading=("time", np.asarray(run.run.reading), data["reading"].attrs))
    data = _with_measured(request, plant, state).assign(reading=data["reading"])
    try:
        check_answers(run)
    except ValueError as error:
        notes.append(str(error))
    figures = {name: float(value) for name, value in vars(merits).items()}
    by_set_point: tuple[SetPointMerit, ...] = ()
    tracking_error: dict[str, float] = {}
    if np.ptp(position) > 0.0:
        figures = {}  # they are those of one set point from the start of the run
        count = len(set_point_spans(position))
        if straight:
            notes.append(StraightLines(loop.set_points))
        elif count <= MOST_SET_POINTS:
            by_set_point = merit_by_set_point(run, plant, assumed=assumed)
        else:
            notes.append(TooManySetPoints(count))
        if not by_set_point:
            tracking_error = _tracking_error(np.asarray(run.run.position) - position)
    notes += notes_of_set_points(assumed, position) or notes_of_reach(setup, position, figures, by_set_point)
    return RunResult(
        data=data,
        system=plant,
        assumed=assumed,
        merit=figures,
        notes=tuple(notes),
        tracking_error=tracking_error,
        by_set_point=by_set_point,
        mismatches=mismatches(assumed, plant),
        settings=sources,
        loop=settings_of(assumed, own, *sensor),
        controller=controller,
    )
