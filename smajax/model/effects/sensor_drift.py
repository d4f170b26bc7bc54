"""A sensor that drifts in time."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.types import Scalar


class SensorDrift(AbstractEffect):
    r"""$y = x + a t$ from the start of each run."""

    rate: Scalar = parameter("m/s", -10.0, 10.0, "a: drift of the reading (rad/s on an arm, 1/s for a strain)")

    effect_name: ClassVar[str] = "sensor_drift"
    title: ClassVar[str] = "sensor drift"
    equation: ClassVar[str] = "sensor"
    formula: ClassVar[str] = "y = x + a t within each run"
    sentence: ClassVar[str] = "The reading walks away with time although the wire does the same in every cycle."
    switches: ClassVar[tuple[str, ...]] = ("rate",)
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"rate": 1e-5}

    @classmethod
    def base(cls) -> SensorDrift:
        return cls(rate=0.0)

    @classmethod
    def spans(cls, extent: Extent) -> dict[str, tuple[float, float]]:
        most = extent.stroke / extent.seconds
        return {"rate": (-most, most)}

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.rate * time
