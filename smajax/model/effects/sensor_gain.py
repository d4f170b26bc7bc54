"""A sensor with a wrong scale."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar


class SensorGain(AbstractEffect, SensorTerm):
    r"""$y = (1 + a) x$, about the zero of the model's reading."""

    error: Scalar = parameter("-", -0.5, 0.5, "a: relative error of the scale", default=0.0)

    effect_name: ClassVar[str] = "sensor_gain"
    candidate: ClassVar[Candidate] = Candidate(
        title="sensor gain",
        equation="sensor",
        formula="y = (1 + a) x between the true value x and the reading y",
        sentence="The sensor's scale is off: every stroke reads too long or too short by the same share.",
        switches=("error",),
        initial_guess={"error": 0.01},
        prior_class="bench",
        widths={
            "error": Width(0.03, "displacement sensors: 0.2 to 2 %; scales set by hand and by camera: up to 5 %"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return (1.0 + self.error) * reading
