"""The least time in which a set point can be reached at all: the line under the reach time of every controller.

More voltage never makes the wire cooler, and a hotter wire never has more martensite, so no command is above the set point earlier than the largest one, and
none is below it earlier than none. What the largest command does not reach is unreachable: of the plant, not of a controller.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import evaluated_loop
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference, clock, constant
from smajax.core.parameters import parameter
from smajax.model.system import System
from smajax.model.types import Scalar


class Largest(AbstractController):
    """The largest command while the position is below the set point at the start, none while it is above."""

    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero")

    def start(self, measured: MeasuredState, wanted: Reference) -> Scalar:
        return jnp.where(wanted.position >= measured.position, 1.0, 0.0)

    def step(self, memory: Scalar, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Scalar, Scalar]:
        return memory, memory * self.largest_voltage


@eqx.filter_jit
def _reach_times(system: System, controller: Largest, targets: Float[Array, " targets"], time: Array) -> Array:
    def one(target: Scalar) -> Scalar:
        setup = ClosedLoopSetup(system, controller, constant(time, target), time[1] - time[0])
        return evaluated_loop(setup)[0].reach_time

    return jax.vmap(one)(targets)


def least_reach_times(
    system: System, set_points: np.ndarray, largest_voltage: float, seconds: float = 10.0, dt: float = 0.005
) -> np.ndarray:
    """Seconds from rest until the plant is first within the band of each set point (rad or m), (set points,).

    Infinite where it is not within `seconds` under the largest command: that set point is unreachable.
    """
    targets = jnp.asarray(set_points, dtype=float)
    return np.asarray(_reach_times(system, Largest(largest_voltage), targets, clock(seconds, dt)))
