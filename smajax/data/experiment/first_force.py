"""The pretension of a blocked wire, which its load cell shows before the heat is on."""

from __future__ import annotations

import numpy as np

from smajax.core.units import UnitError, convert
from smajax.data.readers.table import Array

FIRST = 3  # samples that count where the heat is on from the start
OFF = 0.01  # of the largest command: below, the heat is off
TARED = 0.02  # of the range: a force that begins so near to zero is that of a load cell set to zero with the wire in it
LEAST = 1e-3  # N: the least pretension of the model


def first_force(force: Array, unit: str, command: Array | None) -> float | None:
    """The force that a run begins with, N: the median while the heat is off; None where it begins at none, or `unit` is of no force.

    force: as logged, (n,), nan is a gap. command: of the drive, at the same samples; None where another file has it.
    """
    try:
        newtons = np.asarray(convert(force, unit, "N"))
    except UnitError:
        return None
    there = np.isfinite(newtons)
    if not there.any():
        return None
    count = FIRST
    if command is not None:
        on = np.abs(command) > OFF * np.nanmax(np.abs(command))
        count = max(FIRST, int(np.argmax(on)) if on.any() else newtons.size)
    first = newtons[:count][there[:count]]
    value = float(np.median(first if first.size else newtons[there][:FIRST]))
    return value if value >= max(TARED * float(np.ptp(newtons[there])), LEAST) else None
