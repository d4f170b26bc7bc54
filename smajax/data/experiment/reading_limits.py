"""Readings that are none: beyond any sensor, or of the wrong sign. A later stage would drown in them without a word."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smajax.data.readers.table import Array, MeasuredDataError

LARGEST = 1e15  # in the program's own units: a thousand times any stress in Pa
# Input -> (least value, what it is, whether it may be reached). A load without mass has no motion to integrate.
LEAST = {
    "mass": (0.0, "kg", False),
    "power": (0.0, "W", True),
    "temperature": (-273.15, "degC", False),
    "ambient_temperature": (-273.15, "degC", False),
}


def check_readings(name: str, given: bool, values: Array, where: Callable[[int], str]) -> None:
    """Raises MeasuredDataError for the first value (n,), SI and degC, that the channel `name` cannot have; nan is a gap.

    given: an input, and no sensor, which may be off by its noise. told: where a sample is, and what is written there.
    """
    wrong = np.abs(values) > LARGEST
    why = f"no sensor shows more than {LARGEST:g}"
    if given and name in LEAST:
        least, unit, reached = LEAST[name]
        below = values < least if reached else values <= least
        if below.any() and not wrong.any():
            wrong, why = below, f"expected {'at least' if reached else 'more than'} {least:g} {unit}"
    if wrong.any():
        first = int(np.argmax(wrong))
        more = int(wrong.sum()) - 1
        raise MeasuredDataError(
            f"{where(first)}{f' and in {more} more' if more else ''}; {why}: take such samples out, or correct the unit or the sign"
        )
