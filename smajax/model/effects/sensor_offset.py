"""A sensor whose zero is off."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.types import Scalar


class SensorOffset(AbstractEffect):
    r"""$y = x + a$; nothing new where the experiment lets every run have its own zero."""

    shift: Scalar = parameter("m", -10.0, 10.0, "a: zero of the sensor (rad on an arm, - for a strain)")

    effect_name: ClassVar[str] = "sensor_offset"
    title: ClassVar[str] = "sensor offset"
    equation: ClassVar[str] = "sensor"
    formula: ClassVar[str] = "y = x + a between the true value x and the reading y"
    sentence: ClassVar[str] = "The sensor's zero is not where the model's is: every reading is off by the same amount."
    switches: ClassVar[tuple[str, ...]] = ("shift",)
    starts: ClassVar[dict[str, float]] = {"shift": 1e-4}

    @classmethod
    def base(cls) -> SensorOffset:
        return cls(shift=0.0)

    @classmethod
    def spans(cls, extent: Extent) -> dict[str, tuple[float, float]]:
        return {"shift": (-extent.stroke, extent.stroke)}

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.shift
