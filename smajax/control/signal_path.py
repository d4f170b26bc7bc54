"""What lies between a plant and its controller: a filter, a noisy sensor, a sampling period, a delay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.load_equation import moving_load
from smajax.control.measured_state import Sensor
from smajax.control.position_unit import DEGREES, PositionUnit, position_range, unit_of
from smajax.control.presets import FILTERS, READING_STRAIN, filter_of
from smajax.control.scales import is_arm
from smajax.core.names import close_matches
from smajax.core.units import UnitError, parse_quantity
from smajax.core.wording import counted
from smajax.model.system import System
from smajax.model.types import Scalar

LARGEST_ANGLE = 360.0  # deg


class Interface(eqx.Module):
    """What lies between plant and controller; by default nothing: the true state, at every step, at once."""

    estimator: AbstractEstimator | None = None
    sensor: Sensor | None = None
    every: int = eqx.field(static=True, default=1)  # the controller is called every so many steps
    delay: int = eqx.field(static=True, default=0)  # control periods until its command arrives

    def settings(self, dt: Scalar, key: jax.Array, number: Scalar) -> dict[str, Any]:
        """Arguments of a closed loop; its noise is the one of its `number`."""
        return {
            "dt": dt,
            "every": self.every,
            "estimator": self.estimator,
            "sensor": self.sensor,
            "key": None if self.sensor is None else jax.random.fold_in(key, number.astype(int)),
            "delay": self.delay,
        }


def check_set_points(system: System, set_points: Sequence[float]) -> None:
    """ValueError for set points (deg or mm) beyond the stops of the load or what its wire can do, or none."""
    low, high = position_range(system)
    odd = [point for point in set_points if not low <= point <= high]
    if not odd and set_points:
        return
    unit = unit_of(system)
    if is_arm(system):
        where = "set points are angles between the arm's stops, {}"
    elif all(np.isfinite([float(end) for end in moving_load(system).limits()])):
        where = "set points are between the load's stops, {}"
    else:
        where = "set points are from {}: the stroke of the wire under this load, and a fifth of it more at each end"
    between = where.format(f"{low:g} to {high:g} {'degrees' if unit.is_angle else unit.shown}")
    raise ValueError(
        f"{between}; not {', '.join(f'{point:g}' for point in odd)}." if odd else f"at least one set point; {between}."
    )


def check_interface(filtered: str, noise: float, period: float, dt: float, quantum: float = 0.0) -> None:
    """ValueError for a filter there is not, a noise or quantum (deg or mm) that is no size, or a period (s) of no whole steps of `dt`."""
    for what, size in (("noise", noise), ("quantum", quantum)):
        if not 0.0 <= size < math.inf:
            raise ValueError(f"a {what} is a size in the unit of the reading, 0 or more; not {size:g}.")
    if filtered and filtered not in FILTERS:
        raise ValueError(f"no filter `{filtered}`{close_matches(filtered, FILTERS, 'there are')}.")
    steps = period / dt
    if not 0.5 <= steps < math.inf or abs(steps - round(steps)) > 1e-6:
        raise ValueError(f"a controller's period is a whole number of simulation steps of {dt:g} s, not {period:g} s.")


def noise_of(noise: float | str, unit: PositionUnit) -> float:
    """A noise in the unit shown, from text such as `20um`. UnitError for a unit of another kind, ValueError for no size."""
    value = parse_quantity(noise, unit.shown, bare=unit.shown)
    if not 0.0 <= value <= (LARGEST_ANGLE if unit.is_angle else math.inf):
        expected = f"0 to {LARGEST_ANGLE:g} deg" if unit.is_angle else f"0 {unit.shown} or more"
        raise UnitError(f"{expected}, not `{noise}`")
    return value


def default_noise(system: System) -> float:
    """Standard deviation of a reading, and step of its counter, where nobody says another, in the unit shown: 0.1 deg of the arm.

    Of any load what the same strain of the wire moves, which is also what the filter `adaptive` takes for the noise.
    """
    per_strain = 1.0 / float(moving_load(system).contraction(system.wire))
    return float(f"{float(unit_of(system).of(READING_STRAIN * per_strain)):.2g}")


def interface_of(
    system: System, filtered: str, noise: float, period: float, dt: float, delay: int, quantum: float = 0.0
) -> Interface:
    """What lies between: the filter by name, noise and quantum in deg or mm, period in s, delay in periods.

    The filter has the sensor's noise for that of a reading (`presets.filter_of`).
    """
    unit = unit_of(system)
    sigma = float(unit.to_own(noise))
    sensor = Sensor(noise_sigma=sigma, quantum=float(unit.to_own(quantum)))
    return Interface(
        filter_of(filtered, system, sigma) if filtered else None,
        sensor if noise or quantum else None,
        round(period / dt),
        delay,
    )


def between_in_words(
    filtered: str, noise: float, period: float, delay: int, unit: PositionUnit = DEGREES, quantum: float = 0.0
) -> str:
    """The same in a sentence."""
    what = "angle" if unit.is_angle else "position"
    reads = f"their states from the filter `{filtered}`" if filtered else "the true state"
    read = f"the {what} with {noise:g}{unit.symbol} of noise" if noise else f"the {what} without noise"
    steps = f" in steps of {quantum:g}{unit.symbol}" if quantum else ""
    late = f", commands {counted(delay, 'period')} late" if delay else ""
    return f"Controllers are called every {1e3 * period:g} ms{late} and are told {reads}, {read}{steps}."
