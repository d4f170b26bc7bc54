"""What lies between a plant and its controller: a filter, a noisy sensor, a sampling period, a delay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import numpy as np

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import Sensor
from smajax.control.presets import FILTERS
from smajax.core.names import close_matches
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Scalar


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
    """ValueError for set points (deg) beyond the stops of the load, or none."""
    limits = (
        np.degrees([float(end) for end in system.load.limits()])
        if isinstance(system.load, AbstractMovingLoad)
        else (-np.inf, np.inf)
    )
    odd = [angle for angle in set_points if not limits[0] <= angle <= limits[1]]
    if odd or not set_points:
        raise ValueError(
            f"set points are angles between the arm's stops, {limits[0]:g} to {limits[1]:g} degrees, at least one; not "
            f"{', '.join(f'{angle:g}' for angle in odd) or 'none'}."
        )


def check_interface(filtered: str, noise: float, period: float, dt: float) -> None:
    """ValueError for a filter there is not, a noise (degrees) that is no size, or a period (s) of no whole steps of `dt`."""
    if not 0.0 <= noise < math.inf:
        raise ValueError(f"a noise is a number of degrees, 0 or more; not {noise:g}.")
    if filtered and filtered not in FILTERS:
        raise ValueError(f"no filter `{filtered}`{close_matches(filtered, FILTERS, 'there are')}.")
    steps = period / dt
    if not 0.5 <= steps < math.inf or abs(steps - round(steps)) > 1e-6:
        raise ValueError(f"a controller's period is a whole number of simulation steps of {dt:g} s, not {period:g} s.")


def interface_of(system: System, filtered: str, noise: float, period: float, dt: float, delay: int) -> Interface:
    """What lies between: the filter by name, noise in degrees, period in s, delay in periods."""
    return Interface(
        FILTERS[filtered](system) if filtered else None,
        Sensor(noise_sigma=float(np.radians(noise))) if noise else None,
        round(period / dt),
        delay,
    )


def between_in_words(filtered: str, noise: float, period: float, delay: int) -> str:
    """The same in a sentence."""
    reads = f"their states from the filter `{filtered}`" if filtered else "the true state"
    read = f"the angle with {noise:g}° of noise" if noise else "the angle without noise"
    late = f", commands {delay} periods late" if delay else ""
    return f"Controllers are called every {1e3 * period:g} ms{late} and are told {reads}, {read}."
