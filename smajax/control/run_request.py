"""One run from what a person asks for: model by name, inputs as text -> data set, figures of merit, remarks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from smajax.control.closed_loop import check_answers
from smajax.control.compiled_loop import judged_loop_compiled
from smajax.control.compose import compose, with_values
from smajax.control.figures_of_merit import Rest, merit_by_set_point, rests
from smajax.control.gains_file import Gains, read_gains
from smajax.control.interface import between_in_words, check_interface, check_set_points, interface_of
from smajax.control.loop_dataset import labelled_loop
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import resting
from smajax.core.names import instead
from smajax.core.parameters import parameter_values, parameters
from smajax.core.wording import and_listed
from smajax.data.experiment.magnitude import MELTS
from smajax.data.text_input import clock_of, given
from smajax.model.channels import INPUT_UNITS
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.system import System
from smajax.simulation.dataset import simulate_dataset
from smajax.simulation.simulate import DEFAULT_STEP

MOST_RESTS = 50  # set points; more are a ramp or a sine of a file


class AskedError(ValueError):
    """A part of what was asked cannot be used. part: the field of `Asked` or `AskedLoop`; of an input `inputs.` and its name."""

    def __init__(self, part: str, why: str) -> None:
        super().__init__(why)
        self.part = part


@contextmanager
def _part(name: str) -> Iterator[None]:
    """What is wrong in here is wrong of this part."""
    try:
        yield
    except ValueError as error:
        raise AskedError(name, str(error)) from error


@dataclass(frozen=True)
class Asked:
    """A run: presets by name, values that differ, inputs as text (`levels.given`), and the step, s."""

    wire: str = "niti_table_3_1"
    load: str = "arm"
    drive: str = "amplified_voltage"
    law: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    time: str = ""  # the time column of files
    seconds: float | None = None
    dt: float = DEFAULT_STEP
    tolerance: float | None = None

    def system(self) -> System:
        """The model. Raises KeyError and ValueError as `compose`, AskedError of `values`."""
        bare = compose(self.wire, self.load, self.drive, law=self.law)
        with _part("values"):
            return with_values(bare, self.values)


@dataclass(frozen=True)
class AskedLoop:
    """A closed loop around it; angles in rad, the rest as in a sweep."""

    controller: str
    set_points: str  # levels: `40deg:5s,10deg:5s`
    gains: Path | None = None
    # Values of the plant that the controller does not know, or changes of what it believes: `+20%`.
    mismatch: Mapping[str, str] = field(default_factory=dict)
    estimator: str = ""
    noise: float = 0.0  # degrees
    period: float = 0.01  # s
    delay: int = 0  # periods
    seed: int = 0


@dataclass(frozen=True)
class Mismatch:
    """A parameter that the plant has otherwise than the controller believes, in the program's own unit."""

    name: str
    unit: str
    believed: float | None  # None: its effect is no part of the model that the controller believes
    true: float

    @property
    def ratio(self) -> float | None:
        """Plant over belief; None where nothing is believed, or zero."""
        return self.true / self.believed if self.believed else None


@dataclass(frozen=True)
class Ran:
    """What came out: `found` over time, figures of merit of a closed loop (SI), what should be known of it."""

    found: xr.Dataset
    system: System
    merit: Mapping[str, float]
    notes: tuple[str, ...]
    rests: tuple[Rest, ...] = ()  # figures of merit by set point, where there are several
    mismatches: tuple[Mismatch, ...] = ()


def channels(system: System) -> tuple[frozenset[str], frozenset[str]]:
    """(inputs that the model needs, inputs that it may have besides)."""
    required = system.load.inputs_required | system.drive.inputs_required
    return required, (system.load.inputs_optional | system.drive.inputs_optional | {"ambient_temperature"}) - required


def _unit(name: str) -> str:
    return "N m" if name == "load_torque" else INPUT_UNITS[name]


def _notes(found: xr.Dataset) -> list[str]:
    wrong = [str(name) for name in found.data_vars if not np.isfinite(found[name].to_numpy()).all()]
    told = [f"Numbers that are none in {', '.join(wrong)}: is the heat or the step too large?"] if wrong else []
    hottest = float(found["temperature"].max())
    if hottest > MELTS:
        told.append(f"The wire reaches {hottest:.4g} degC, and it melts at {MELTS:g} degC: is the input's unit right?")
    return told


def run_open(asked: Asked) -> Ran:
    """The run. Raises KeyError and ValueError for what cannot be used, AskedError where the part is known that it is in."""
    system = asked.system()
    required, optional = channels(system)
    for name in asked.inputs:
        if name not in required | optional:
            raise AskedError(
                f"inputs.{name}", f"no input {name!r}{instead(name, sorted(required | optional), 'this model takes')}"
            )
    missing = sorted(required - asked.inputs.keys())
    if missing:
        alone = "--step LEVEL:TIME,LEVEL:TIME or " if len(required) == 1 else ""
        asks = [f"--input {name}={'6V' if name == 'voltage' else 'LEVEL'}:10s" for name in missing]
        named = and_listed([repr(name) for name in missing])
        raise ValueError(
            f"the model needs the input{'s' * (len(missing) > 1)} {named}: give {alone}{' '.join(asks)} (a file: {missing[0]}=log.csv:COLUMN)"
        )
    several = {}
    for name, text in asked.inputs.items():
        with _part(f"inputs.{name}"):
            several[name] = given(text, _unit(name), asked.time, bare=_unit(name))
    clock = clock_of(list(several.values()), asked.seconds, asked.dt)
    measured = system.load.inputs_required if isinstance(system.load, AbstractCoupon) else frozenset()
    series: Any = {
        name: one.on(clock, asked.dt, squared=name in system.drive.inputs_squared, sampled=name in measured)
        for name, one in several.items()
    }
    found = simulate_dataset(system, series, asked.dt, asked.tolerance)
    found = found.assign_coords(time=found["time"].copy(data=clock))  # a sum of steps is off by its rounding
    return Ran(found, system, {}, tuple(_notes(found)))


def mismatches(believed: System, plant: System) -> tuple[Mismatch, ...]:
    """Every parameter in which they differ by more than a unit's rounding."""
    before, units = parameter_values(believed), parameters(plant)
    return tuple(
        Mismatch(name, units[name].unit, before.get(name), value)
        for name, value in parameter_values(plant).items()
        if not math.isclose(before.get(name, math.nan), value, rel_tol=1e-12)
    )


def _beyond(system: System, position: np.ndarray) -> list[str]:
    """That a set point lies where the load cannot go."""
    try:
        check_set_points(system, np.degrees(np.unique([position.min(), position.max()])).tolist())
    except ValueError as error:
        return [f"Asked for what cannot be reached: {error}"]
    return []


def run_closed(asked: Asked, loop: AskedLoop) -> Ran:
    """The closed loop. Raises as `run_open`, and GainsFileError."""
    believed = asked.system()
    if not isinstance(believed.load, AbstractMovingLoad) or believed.load.reading[1] != "rad":
        raise ValueError(f"controllers are those of the arm: give the load `arm`, not `{asked.load}`.")
    gains = Gains(loop.controller, {}) if loop.gains is None else read_gains(loop.gains, believed)
    if gains.controller not in CONTROLLERS:
        raise ValueError(f"no controller {gains.controller!r}{instead(gains.controller, CONTROLLERS, 'there are')}")
    preset = CONTROLLERS[gains.controller]
    believed = preset.plant(believed)
    with _part("mismatch"):
        plant = with_values(believed, loop.mismatch)  # of what this controller believes
    check_interface(loop.estimator, loop.noise, loop.period, asked.dt)
    between = interface_of(believed, loop.estimator, loop.noise, loop.period, asked.dt, loop.delay)
    with _part("set_points"):
        wanted = given(loop.set_points, "rad", asked.time, bare="deg")
    clock = clock_of([wanted], asked.seconds, asked.dt)
    periods = (clock.size - 1) // between.every
    if periods < 1:
        raise ValueError(f"the run is shorter than one control period of {loop.period:g} s.")
    clock = clock[: periods * between.every + 1]
    # A set point holds from its instant on: a mean over the step before it would come early.
    position = wanted.at(clock)
    ran, merits = judged_loop_compiled(
        plant,
        gains.put(believed),
        resting(jnp.asarray(position)),
        asked.dt,
        between.every,
        estimator=between.estimator,
        sensor=between.sensor,
        key=None if between.sensor is None else jax.random.key(loop.seed),
        delay=between.delay,
    )
    # As in `run_open`.
    ran = eqx.tree_at(lambda one: one.run.time, ran, jnp.asarray(clock))
    told = between_in_words(loop.estimator, loop.noise, loop.period, loop.delay)
    found = labelled_loop(
        plant, ran, dt=asked.dt, controller=gains.controller, gains=parameter_values(gains.put(believed)), between=told
    )
    notes = _notes(found)
    try:
        check_answers(ran)
    except ValueError as error:
        notes.append(str(error))
    notes += _beyond(believed, position)
    count = len(rests(position))
    judged = {name: float(value) for name, value in vars(merits).items()}
    several: tuple[Rest, ...] = ()
    if np.ptp(position) > 0.0:
        judged = {}  # they look at one set point from the start of the run
        if count <= MOST_RESTS:
            several = merit_by_set_point(ran, plant)
        else:
            notes.append(
                f"Figures of merit are those of set points that rest, {MOST_RESTS} at most: this one has {count}."
            )
    return Ran(found, plant, judged, tuple(notes), several, mismatches(believed, plant))
