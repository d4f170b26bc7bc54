"""The least time in which a set point can be reached at all: the line under the reach time of every controller.

More voltage never makes the wire cooler, and a hotter wire never has more martensite, so no command is above the set point earlier than the largest one, and
none is below it earlier than none. What the largest command does not reach is unreachable: of the plant, not of a controller.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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

    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero", limits_command=True)

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


def command_limit(system: System, controller: AbstractController) -> float:
    """Largest command that the controller may give and the drive follows, in the unit of the drive's command; infinite where neither has a limit.

    That of a controller is its `largest_command()`.
    """
    return min(float(system.drive.largest_command()), float(controller.largest_command()))


class Distance(NamedTuple):
    """Settling time over the least time of the same set point on the same plant, of several runs; what is out of reach is counted by itself."""

    median: float  # of the runs that settle; NaN where none does
    worst: float  # of these
    settled: int
    never: int  # in reach of the plant, and the run does not settle: failures of the controller
    unreachable: int  # of the plant, with the largest command


def distance(settling: np.ndarray, least: np.ndarray) -> Distance:
    """settling: s, infinite where a run never settles; least: s, infinite where the largest command does not get there; any shape, the same.

    Runs that begin at their set point, where the least time is 0, have no ratio and count among those that settle, or do not.
    """
    settled, in_reach = np.isfinite(settling), np.isfinite(least)
    ratio = settling[settled & in_reach & (least > 0.0)] / least[settled & in_reach & (least > 0.0)]
    median, worst = (float(np.median(ratio)), float(ratio.max())) if ratio.size else (math.nan, math.nan)
    return Distance(
        median, worst, int(settled.sum()), int((in_reach & ~settled).sum()), int((~in_reach & ~settled).sum())
    )
