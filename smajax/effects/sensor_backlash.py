"""A sensor with backlash: it follows only when the play has been taken up."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar


class SensorBacklash(AbstractEffect):
    r"""$y \to \min(\max(y, x - b), x + b)$, the play operator: y stays until x is b away from it."""

    half_width: Scalar = parameter("m", 0.0, 0.02, "b: half of the play (rad on an arm, - for a strain)")

    effect_name: ClassVar[str] = "sensor_backlash"
    title: ClassVar[str] = "backlash of the sensor"
    equation: ClassVar[str] = "sensor"
    formula: ClassVar[str] = "y = min(max(y_before, x - b), x + b) (play operator)"
    sentence: ClassVar[str] = (
        "The sensor's coupling has play: after every turn the reading stays where it is until the play is taken up."
    )
    switches: ClassVar[tuple[str, ...]] = ("half_width",)
    starts: ClassVar[dict[str, float]] = {"half_width": 1e-4}
    recalls: ClassVar[bool] = True

    @classmethod
    def base(cls) -> SensorBacklash:
        return cls(half_width=0.0)

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        # At b = 0 both bounds are x, and the derivative by b is that of the side on which the play lies.
        low, high = reading - self.half_width, reading + self.half_width
        return jnp.where(last <= low, low, jnp.where(last >= high, high, last))
