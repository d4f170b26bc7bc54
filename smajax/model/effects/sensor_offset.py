"""A sensor whose zero is off."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    return {"shift": (-extent.stroke, extent.stroke)}


class SensorOffset(AbstractEffect, SensorTerm):
    r"""$y = x + a$; nothing new where the experiment lets every run have its own zero."""

    shift: Scalar = parameter(
        "m", -10.0, 10.0, "a: zero of the sensor (rad on an arm, - for a strain)", of_load="reading", default=0.0
    )

    effect_name: ClassVar[str] = "sensor_offset"
    candidate: ClassVar[Candidate] = Candidate(
        title="sensor offset",
        equation="sensor",
        formula="y = x + a between the true value x and the reading y",
        sentence="The sensor's zero is not where the model's is: every reading is off by the same amount.",
        switches=("shift",),
        initial_guess={"shift": 1e-4},
        bounds=_bounds,
        prior_class="bench",
        widths={
            "shift": Width(0.01, "a zero set by hand: 0.1 to 2 % of the stroke", of="stroke"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.shift
