"""A sensor with a wrong scale."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar


class SensorGain(AbstractEffect):
    r"""$y = (1 + a) x$, about the zero of the model's reading."""

    error: Scalar = parameter("-", -0.5, 0.5, "a: relative error of the scale")

    effect_name: ClassVar[str] = "sensor_gain"
    title: ClassVar[str] = "sensor gain"
    equation: ClassVar[str] = "sensor"
    formula: ClassVar[str] = "y = (1 + a) x between the true value x and the reading y"
    sentence: ClassVar[str] = "The sensor's scale is off: every stroke reads too long or too short by the same share."
    switches: ClassVar[tuple[str, ...]] = ("error",)
    starts: ClassVar[dict[str, float]] = {"error": 0.01}

    @classmethod
    def base(cls) -> SensorGain:
        return cls(error=0.0)

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return (1.0 + self.error) * reading
