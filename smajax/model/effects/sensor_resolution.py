"""A sensor of coarse resolution: a staircase."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar

PHASES = 12
COARSE = 3.0  # noises
SHARPNESS = 8  # half the power of the sine
_MIDDLE = math.comb(2 * SHARPNESS, SHARPNESS)
STEEPEST = 4.0**SHARPNESS / _MIDDLE  # with which the mean slope is one
SQUARE = math.comb(4 * SHARPNESS, 2 * SHARPNESS) / _MIDDLE**2  # mean of its square then


def _observable(extent: Extent) -> bool:
    # A finer stair is within the noise, and its edges, by which a fit goes, are not to be seen in it.
    return extent.increment > COARSE * extent.noise


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    # The increment is read off the log; where the levels lie on the model's scale, which has another zero, is not.
    step = extent.increment
    return tuple({"increment": step, "zero": step * phase / PHASES} for phase in range(PHASES))


class SensorResolution(AbstractEffect, SensorTerm):
    r"""$y = (1 - s)\,x + s\,\{z + q\,\mathrm{round}[(x - z)/q]\}$; a share s of one is the staircase itself.

    The stair's own derivative is zero wherever it is flat, and would tell a fit nothing of when the motion goes from one level to the next. In its place is
    $5.09 \sin^{16}(\pi u)$, $u = (x - z)/q$, of mean one: a sample weighs the more the nearer it is to an edge. With $2 \sin^2(\pi u)$ a fit
    holds back for samples between edges, which a motion within a level leaves as they are, and more of them end on the wrong side of an edge. Standard errors
    and evidence are those of a sensor without a stair (`Candidate.square_of_slope`); a coarse stair tells less than that.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "s: share of the staircase in the reading", default=0.0)
    increment: Scalar = parameter(
        "m",
        1e-7,
        0.5,
        "q: from one reading to the next (rad on an arm, - for a strain)",
        of_load="reading",
        default=0.001,
    )
    zero: Scalar = parameter(
        "m", -0.5, 0.5, "z: one of the readings (rad on an arm, - for a strain)", of_load="reading", default=0.0
    )

    effect_name: ClassVar[str] = "sensor_resolution"
    candidate: ClassVar[Candidate] = Candidate(
        title="resolution of the sensor",
        equation="sensor",
        formula="y = (1 - s) x + s {z + q round[(x - z)/q]} (quantisation)",
        sentence="The sensor shows steps: between two of its readings it does not see the motion.",
        switches=("share",),
        initial_guess={"share": 0.9, "increment": 1e-3, "zero": 0.0},
        observable=_observable,
        square_of_slope=SQUARE,
        grid=_grid,
        prior_class="bench",
        widths={
            "share": Width(0.5, "a sensor that has the staircase has all of it"),
            "increment": Width(0.05, "read off the levels of the log", logarithmic=True, of="increment", base=1.0),
            "zero": Width(0.5, "any place within one increment", of="increment"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        fixed = jax.lax.stop_gradient
        steps = (reading - self.zero) / self.increment
        slope = STEEPEST * jnp.sin(jnp.pi * fixed(steps)) ** (2 * SHARPNESS)
        level = jnp.floor(fixed(steps) + 0.5) + slope * (steps - fixed(steps))
        return reading + self.share * (self.zero + self.increment * level - reading)
