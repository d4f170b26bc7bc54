"""A sensor whose reading ends at an upper or a lower limit, short of what the load does."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.sensor_reading import SensorTerm
from smajax.model.types import Scalar

# Of the stroke, from the end of the readings inwards: the base model is fitted to readings that were cut off, so at the limit
# itself it hardly goes beyond.
INWARDS = (0.01, 0.05, 0.15)
LIMIT_SOURCE = "a reading that is cut off ends at the limit, within its noise and the zero of a run"
CUT_SOURCE = "at its limit an amplifier, a converter or a picture shows nothing more: all of it is lost"


def _observable(extent: Extent) -> bool:
    return extent.highest > extent.lowest


def _bounds(extent: Extent) -> dict[str, tuple[float, float]]:
    if not _observable(extent):
        return {}
    return dict.fromkeys(("upper", "lower"), (extent.lowest, extent.highest))


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    inwards = [share * extent.stroke for share in INWARDS]
    return tuple({"upper": extent.highest - one, "lower": extent.lowest + one} for one in inwards)


class SensorLimit(AbstractEffect, SensorTerm):
    r"""$y = x - s_u \max(x - y_u, 0) + s_l \max(y_l - x, 0)$; a share s of one is the limit itself.

    Limits are on the scale of the reading, as the runs show it. A share between zero and one is a sensor that is only less
    sensitive beyond the limit.
    """

    upper_cut: Scalar = parameter(
        "-", 0.0, 1.0, "s_u: share of the motion above the upper limit that is lost", default=0.0
    )
    upper: Scalar = parameter(
        "m", -10.0, 10.0, "y_u: upper limit (rad on an arm, - for a strain)", of_load="reading", default=10.0
    )
    lower_cut: Scalar = parameter(
        "-", 0.0, 1.0, "s_l: share of the motion below the lower limit that is lost", default=0.0
    )
    lower: Scalar = parameter(
        "m", -10.0, 10.0, "y_l: lower limit (rad on an arm, - for a strain)", of_load="reading", default=-10.0
    )

    effect_name: ClassVar[str] = "sensor_limit"
    candidate: ClassVar[Candidate] = Candidate(
        title="limit of the sensor",
        equation="sensor",
        formula="y = x - s_u max(x - y_u, 0) + s_l max(y_l - x, 0) (saturation)",
        sentence="The sensor ends before the motion does: beyond a limit its reading stays where it is, in every run.",
        switches=("upper_cut", "lower_cut"),
        initial_guess={"upper_cut": 0.9, "upper": 0.018, "lower_cut": 0.9, "lower": 0.001},
        observable=_observable,
        grid=_grid,
        bounds=_bounds,
        prior_class="bench",
        widths={
            "upper_cut": Width(0.5, CUT_SOURCE),
            "upper": Width(0.05, LIMIT_SOURCE, of="stroke", base=0.0, above="highest"),
            "lower_cut": Width(0.5, CUT_SOURCE),
            "lower": Width(0.05, LIMIT_SOURCE, of="stroke", base=0.0, above="lowest"),
        },
    )

    def sensed(self, reading: Scalar, time: Scalar, last: Scalar) -> Scalar:
        above, below = (jnp.maximum(one, 0.0) for one in (reading - self.upper, self.lower - reading))
        return reading - self.upper_cut * above + self.lower_cut * below
