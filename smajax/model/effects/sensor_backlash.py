"""A sensor with backlash: it follows only when the play has been taken up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import LOST_MOTION, Candidate, Extent, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar

# The score test knows a play so small that it is taken up at once: over what it says, from all over which refits begin.
MORE = (1.0, 16.0)


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    return {"half_width": (0.0, 0.5 * extent.stroke)}


def _start_ranges(switches: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    at = switches.get("half_width", 0.0)
    return {"half_width": (MORE[0] * at, MORE[1] * at)} if at > 0.0 else {}


class SensorBacklash(AbstractEffect, SensorTerm):
    r"""$y \to \min(\max(y, x - b), x + b)$, the play operator: y stays until x is b away from it."""

    half_width: Scalar = parameter(
        "m", 0.0, 10.0, "b: half of the play (rad on an arm, - for a strain)", of_load="reading", default=0.0
    )

    effect_name: ClassVar[str] = "sensor_backlash"
    candidate: ClassVar[Candidate] = Candidate(
        title="backlash of the sensor",
        equation="sensor",
        formula="y = min(max(y_before, x - b), x + b) (play operator)",
        sentence="The sensor's coupling has play: after every turn the reading stays where it is until the play is taken up.",
        switches=("half_width",),
        initial_guess={"half_width": 1e-4},
        bounds=_bounds,
        start_ranges=_start_ranges,
        prior_class="bench",
        similar_group=LOST_MOTION,
        widths={
            "half_width": Width(0.01, "couplings and gears of sensors: 0.1 to 2 % of the stroke", of="stroke"),
        },
    )
    recalls: ClassVar[bool] = True

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        # At b = 0 both bounds are x, and the derivative by b is that of the side on which the play lies.
        low, high = reading - self.half_width, reading + self.half_width
        return jnp.where(last <= low, low, jnp.where(last >= high, high, last))
