"""First-order lag of the sensor."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import DELAY, Candidate, Width
from smajax.model.sensor_reading import SensorLagTerm
from smajax.model.types import Scalar


class SensorLag(AbstractEffect, SensorLagTerm):
    r"""$\tau \dot y + y = x$: the reading y follows the true value x."""

    time_constant: Scalar = parameter("s", 0.0, 10.0, "tau", default=0.0)

    effect_name: ClassVar[str] = "sensor_lag"
    candidate: ClassVar[Candidate] = Candidate(
        title="sensor lag",
        equation="sensor",
        formula="tau dy/dt + y = x between the true value x and the reading y",
        sentence="The sensor (or its filter) shows the value with a delay: the motion is right, the reading is late.",
        switches=("time_constant",),
        initial_guess={"time_constant": 0.1},
        needs_time=True,
        similar_group=DELAY,
        prior_class="bench",
        widths={
            "time_constant": Width(0.05, "filters of displacement sensors and amplifiers: 1 to 100 ms"),
        },
    )

    def sensor_time_constant(self) -> Scalar | float:
        return self.time_constant
