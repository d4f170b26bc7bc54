"""First-order lag of the sensor."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar


class SensorLag(AbstractEffect):
    r"""$\tau \dot y + y = x$: the reading y follows the true value x."""

    time_constant: Scalar = parameter("s", 0.0, 10.0, "tau")

    effect_name: ClassVar[str] = "sensor_lag"
    title: ClassVar[str] = "sensor lag"
    equation: ClassVar[str] = "sensor"
    formula: ClassVar[str] = "tau dy/dt + y = x between the true value x and the reading y"
    sentence: ClassVar[str] = (
        "The sensor (or its filter) shows the value with a delay: the motion is right, the reading is late."
    )
    switches: ClassVar[tuple[str, ...]] = ("time_constant",)
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"time_constant": 0.1}

    @classmethod
    def base(cls) -> SensorLag:
        return cls(time_constant=0.0)

    def sensor_time_constant(self) -> Scalar | float:
        return self.time_constant
