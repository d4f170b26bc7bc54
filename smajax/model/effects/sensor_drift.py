"""A sensor that drifts in time."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    most = extent.stroke / extent.seconds
    return {"rate": (-most, most)}


class SensorDrift(AbstractEffect, SensorTerm):
    r"""$y = x + a t$ from the start of each run."""

    rate: Scalar = parameter(
        "m/s",
        -10.0,
        10.0,
        "a: drift of the reading (rad/s on an arm, 1/s for a strain)",
        of_load="reading rate",
        default=0.0,
    )

    effect_name: ClassVar[str] = "sensor_drift"
    candidate: ClassVar[Candidate] = Candidate(
        title="sensor drift",
        equation="sensor",
        formula="y = x + a t within each run",
        sentence="The reading walks away with time although the wire does the same in every cycle.",
        switches=("rate",),
        initial_guess={"rate": 1e-5},
        needs_time=True,
        bounds=_bounds,
        prior_class="event",
        widths={
            "rate": Width(0.01, "warming-up of sensors and amplifiers: 0.1 to 1 % of the stroke", of="stroke/run"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        return reading + self.rate * time
