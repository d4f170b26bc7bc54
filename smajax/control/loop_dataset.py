"""A system under a controller as one thing, and its run as a labelled data set."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from smajax.control.closed_loop import ClosedLoop, ClosedLoopSetup, check_answers
from smajax.control.compiled_loop import measured_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import Sensor
from smajax.control.position_unit import beyond_ends
from smajax.control.reference import Reference
from smajax.control.reference_file import reference_of
from smajax.control.signal_path import check_interface
from smajax.core.parameters import check_bounds, parameter_values
from smajax.data.text_input import clock_of, given
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.simulation.dataset import labelled_run
from smajax.simulation.integration_error import AUTO, IntegrationError, Tolerance
from smajax.simulation.simulate import DEFAULT_STEP, warn_of_length

PERIOD = 0.01  # s, of the controller
BEYOND = 0.01  # of the way between the end stops: from there on a set point is a mistake
ESTIMATE = "estimated_"  # before the name of a variable: what the filter makes of it
ESTIMATED = ("position", "velocity", "stress", "temperature", "martensite_fraction")
SAMPLED = "sampled"  # attribute of a `reading` that is no state of the plant: the sensor's, held for a control period


class SetPointWarning(UserWarning):
    """A set point lies beyond the end stops of the load, or further than the wire is long."""


class Loop(eqx.Module):
    """A plant and what commands its voltage: `compose(..., controller="pid")`."""

    system: System
    controller: AbstractController
    estimator: AbstractEstimator | None = None  # None: the controller is told the true state
    sensor: Sensor | None = None  # None: the reading has no noise
    delay: int = eqx.field(static=True, default=0)  # control periods until a command arrives
    assumed: System | None = (
        None  # the plant as the controller knows it, by whose drive a command becomes an input; None: as it is
    )


def labelled_loop(
    system: System,
    loop: ClosedLoop,
    error: IntegrationError | None = None,
    *,
    estimated: bool = False,
    **settings: object,
) -> xr.Dataset:
    """A closed loop as `labelled_run`, with the command `voltage` (V; of such a drive `current` or `power`) and the position `wanted`.

    Where a sensor reads the position, `reading` is what it says: with its noise and steps, once a control period and held; `position` is the true one. estimated: what the controller was told is a
    filter's estimate, and is `estimated_position`, `estimated_temperature` and so on, beside the true ones.
    A mapping among the settings, such as `gains`, becomes JSON.
    """
    attributes = {name: json.dumps(dict(one)) if isinstance(one, Mapping) else one for name, one in settings.items()}
    result = labelled_run(system, loop.run, {system.drive.command[0]: loop.voltage}, error, **attributes)
    position = result["position"].attrs["units"]
    if not np.array_equal(loop.reading, loop.run.reading, equal_nan=True):
        of_sensor = {
            "long_name": "reading of the position sensor",
            SAMPLED: "once a control period, with the noise and steps of the sensor",
        }
        result["reading"] = ("time", np.asarray(loop.reading), {**result["reading"].attrs, **of_sensor})
    for name in ESTIMATED if estimated else ():
        of_filter = {
            "long_name": f"{result[name].attrs.get('long_name', name)}, as the filter estimates it",
            "units": result[name].attrs["units"],
            SAMPLED: "once a control period, as the controller is told",
        }
        result[f"{ESTIMATE}{name}"] = ("time", np.asarray(getattr(loop.measured, name)), of_filter)
    result["wanted"] = ("time", np.asarray(loop.wanted.position), {"units": position, "long_name": "set point"})
    return result


def simulate_loop_dataset(
    loop: Loop,
    set_point: float | str | Reference,
    seconds: float | None = None,
    dt: float = DEFAULT_STEP,
    period: float = PERIOD,
    tolerance: Tolerance = AUTO,
    *,
    disturbance: Mapping[str, ArrayLike] | None = None,
    seed: int = 0,
) -> xr.Dataset:
    """Run a loop from rest: an `xarray.Dataset` over time (s), with the command `voltage` (V) and the position `wanted`.

    set_point: a number (rad or m), text with a unit (`"40 deg"`), levels each with its time (`"40deg:5s,10deg:5s"`, which
    need no `seconds`; millimetres of a length), a column of a file (`"log.csv:COLUMN:deg"`, on straight lines between its rows; `"log.csv:COLUMN:deg:held"`,
    each row until the next), or a `Reference` of samples `dt` apart, which has its own length. The controller is called every
    `period` seconds. disturbance: further inputs by channel, a value a sample; seed: of the sensor's noise, which is in `reading` and not in `position`. `tolerance`, and what the integration leaves in the result, as `simulate_dataset`'s.

    Raises TypeError for what is no `Loop` (a system without a controller), UnitError for a unit of another kind, ValueError
    for a coupon, a parameter or gain out of its bounds, a period that is no multiple of `dt`, a run without a length or
    shorter than a period, and a controller whose answer is no number.
    """
    if not isinstance(loop, Loop):
        raise TypeError(
            f"expected a Loop, got {type(loop).__name__}: `compose(..., controller='pid')` or `Loop(system, controller)`."
        )
    system, controller = loop.system, loop.controller
    if not isinstance(system.load, AbstractMovingLoad):
        raise ValueError(
            f"a {type(system.load).__name__} moves nothing that a controller could lead: give another load."
        )
    check_bounds(system)
    check_interface("", 0.0, period, dt)
    every = round(period / dt)
    wanted = _wanted(set_point, system.load.reading[1], seconds, dt)
    _warn_beyond_stops(system, wanted)
    samples = (wanted.position.shape[0] - 1) // every * every + 1
    if samples <= every:
        raise ValueError(f"the run is shorter than one control period of {period:g} s.")
    if seconds is not None:
        warn_of_length(seconds, (samples - 1) * dt, dt * every, stacklevel=3)
    wanted = Reference(wanted.position[:samples], wanted.velocity[:samples], wanted.acceleration[:samples])
    key = None if loop.sensor is None else jax.random.key(seed)
    inputs = {name: jnp.asarray(values, dtype=float) for name, values in (disturbance or {}).items()}
    between = (loop.estimator, loop.sensor, key, loop.delay, inputs)
    run, _, error = measured_loop(
        ClosedLoopSetup(system, controller, wanted, dt, every, *between, assumed=loop.assumed), tolerance
    )
    check_answers(run)
    return labelled_loop(
        system,
        run,
        error,
        estimated=loop.estimator is not None,
        dt=dt,
        period=period,
        controller=type(controller).__name__,
        gains=parameter_values(controller),
    )


def _warn_beyond_stops(system: System, wanted: Reference) -> None:
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    (low, high), unit = map(float, load.limits()), load.reading[1]
    stops = f"the load between its end stops from {low:.4g} to {high:.4g} {unit}"
    if math.isinf(low) and math.isinf(high):  # no stops: no wire becomes shorter by its whole length
        high = 1.0 / abs(float(load.contraction(system.wire)))
        low, stops = -high, f"the load at most {high:.4g} {unit} if the wire became shorter by all of its length"
    if beyond := beyond_ends(wanted.position, (low, high), BEYOND):
        warnings.warn(
            f"the set point goes from {beyond[0]:.4g} to {beyond[1]:.4g} {unit}, and {stops}: "
            f"a number is in {unit}; of another unit give text (`'{'60 deg' if unit == 'rad' else '2 mm'}'`).",
            SetPointWarning,
            stacklevel=3,
        )


def _wanted(set_point: float | str | Reference, unit: str, seconds: float | None, dt: float) -> Reference:
    """The set point over time; `unit` is that of a number."""
    if isinstance(set_point, Reference):
        if seconds is not None:
            raise ValueError("a Reference has its own length: leave `seconds` out.")
        return set_point
    desired = given(set_point if isinstance(set_point, str) else f"{float(set_point)!r} {unit}", unit)
    if seconds is None and desired.seconds is None:
        raise ValueError(
            "nothing says how long the run is: give `seconds`, or levels with times ('40deg:5s,10deg:5s')."
        )
    return reference_of(desired, clock_of([desired], seconds, dt), dt)
