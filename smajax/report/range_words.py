"""A fitted transformation range that is reversed, or has next to no width, in words."""

from __future__ import annotations

from collections.abc import Mapping

from smajax.core.display_units import digits
from smajax.model.wire.kinetics import NARROWEST_RANGE
from smajax.model.wire.order import RANGES

# Of each of `RANGES`: how the two ends are written, the stroke, and what a run has to do to show both ends.
_SAID = (
    ("A_s < A_f", "on heating", "heats until the transformation has ended"),
    ("M_f < M_s", "on cooling", "cools until the transformation has ended"),
)


def range_sentences(values: Mapping[str, float]) -> list[str]:
    """One sentence or more for each range at fault; values: name -> value, degrees Celsius."""
    result = []
    for (low, high, _), (order, stroke, run) in zip(RANGES, _SAID, strict=True):
        if low not in values or high not in values or values[high] - values[low] > NARROWEST_RANGE:
            continue
        whole = f"Give bounds in which the two cannot pass each other, or a run that {run}."
        if values[low] >= values[high]:
            result.append(
                f"Mind: the range {stroke} is reversed: {low} is {digits(values[low])} °C and {high} {digits(values[high])} °C, but of a wire {order}. "
                f"The model takes it as a step at {low}, and `smajax predict` and `smajax tune` refuse such a model. {whole}"
            )
        else:
            result.append(
                f"Mind: {low} and {high} end together, at {digits(values[low])} °C: {stroke} the fitted wire transforms in a step, which no wire does, "
                f"and the runs do not show how wide the range is. {whole}"
            )
    return result
