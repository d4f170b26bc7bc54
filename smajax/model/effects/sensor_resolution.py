"""A sensor of coarse resolution: a staircase."""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Self

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.sensor_reading import LevelTerm
from smajax.model.types import Scalar, Series

PHASES = 12
COARSE = 3.0  # noises
KNOWN = 0.25  # of a level, over the stroke: how well the increment is read off the log
# Slope within a level in a fit, against 1 outside: by more of it a fit takes the noise of readings there for something to follow, and stops a twentieth of
# the noise above the least squares; with none the normal equations are singular where no sample lies outside of its level.
WITHIN = 0.05


def _observable(extent: Extent) -> bool:
    # A finer stair is within the noise, and its edges, by which a fit goes, are not to be seen in it.
    return extent.increment > COARSE * extent.noise


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    # How far a motion lies outside of levels that are as wide as one likes is nothing: a free increment would take up whatever else is missing.
    step = extent.increment
    if not step > 0.0:
        return {}
    about = 1.0 + KNOWN * step / extent.stroke
    return {"increment": (step / about, step * about)}


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    # The increment is read off the log; where the levels lie on the model's scale, which has another zero, is not.
    step = extent.increment
    return tuple({"increment": step, "zero": step * phase / PHASES} for phase in range(PHASES))


class SensorResolution(AbstractEffect, LevelTerm):
    r"""$y = (1 - s)\,x + s\,\{z + q\,\mathrm{round}[(x - z)/q]\}$; a share s of one is the staircase itself.

    A fit holds against a measured level how far the motion lies outside of it (`near`), and not the next level: a motion that is a hair late at an edge
    is off by a hair, and not by a whole increment, which outweighed all that the other samples say. Within the level nothing pulls at the motion. Of a run levels are
    counted from one of its own, and which of the model's that is follows from the run as a whole: the one with which the motion lies least outside. Standard errors
    and evidence are those of readings with the variance of a level beside their noise (`with_mean_slope`).
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

    within: Scalar = eqx.field(converter=jnp.asarray, default=WITHIN)
    mean: Scalar = eqx.field(converter=jnp.asarray, default=1.0)  # slope of the reading where nothing was measured

    effect_name: ClassVar[str] = "sensor_resolution"
    candidate: ClassVar[Candidate] = Candidate(
        title="resolution of the sensor",
        equation="sensor",
        formula="y = (1 - s) x + s {z + q round[(x - z)/q]} (quantisation)",
        sentence="The sensor shows steps: between two of its readings it does not see the motion. What a model is off by is "
        "how far its motion lies outside of the level that was read.",
        switches=("share",),
        initial_guess={"share": 0.9, "increment": 1e-3, "zero": 0.0},
        observable=_observable,
        bounds=_bounds,
        grid=_grid,
        prior_class="bench",
        widths={
            "share": Width(0.5, "a sensor that has the staircase has all of it"),
            "increment": Width(0.05, "read off the levels of the log", logarithmic=True, of="increment", base=1.0),
            "zero": Width(0.5, "any place within one increment", of="increment"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        steps = (reading - self.zero) / self.increment
        return self._shown(reading, steps, _nearest(steps), 0.0, self.mean)

    def near(self, reading: Series, measured: Series, level: Scalar) -> Series:
        steps = (reading - self.zero) / self.increment
        fixed, missing = jax.lax.stop_gradient(steps), jnp.isnan(measured)
        counted = _nearest((jnp.where(missing, level, measured) - level) / self.increment)
        # The run may have a zero of its own, of any size: its levels are those of the model but for a whole number.
        present = jnp.where(missing, 0.0, 1.0)
        about = _nearest(jnp.sum(present * (fixed - counted)) / jnp.maximum(jnp.sum(present), 1.0))
        lower, same, higher = (
            jnp.sum(present * _outside(fixed - counted - about - shift) ** 2) for shift in (-1.0, 0.0, 1.0)
        )
        shift = jnp.where(same <= jnp.minimum(lower, higher), 0.0, jnp.where(lower <= higher, -1.0, 1.0))
        number = jnp.where(missing, _nearest(steps), counted + about + shift)
        within = jnp.where(missing, self.mean, self.within)
        return self._shown(reading, steps, number, _outside(steps - number), within)

    def with_mean_slope(self, noise: Scalar | float) -> Self:
        mean = 1.0 / jnp.sqrt(1.0 + self.increment**2 / (12.0 * noise**2))
        return dataclasses.replace(self, within=jnp.asarray(mean), mean=jnp.asarray(mean))

    def _shown(
        self, reading: Scalar, steps: Scalar, number: Scalar, outside: Scalar | float, within: Scalar | float
    ) -> Scalar:
        """The level of that `number`, and how far the reading lies `outside` of it, in increments; `within` it with that slope."""
        along = within * (steps - jax.lax.stop_gradient(steps))
        level = number + jnp.where(outside == 0.0, along, outside)
        return reading + self.share * (self.zero + self.increment * level - reading)


def _outside(steps: Scalar) -> Scalar:
    """How far a motion lies outside of the level from -1/2 to 1/2."""
    return jnp.where(steps > 0.5, steps - 0.5, jnp.where(steps < -0.5, steps + 0.5, 0.0))


def _nearest(steps: Scalar) -> Scalar:
    return jnp.floor(jax.lax.stop_gradient(steps) + 0.5)
