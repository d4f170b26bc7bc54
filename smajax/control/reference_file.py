"""A measured or computed path in a file -> what the position should be."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from smajax.control.reference import Reference, clock, resting, sampled
from smajax.core.units import convert
from smajax.data.readers.read import read_table
from smajax.data.readers.table import check_time


def read_reference(
    path: str | Path, time: str | int, position: str | int, unit: str, dt: float, *, held: bool = False
) -> Reference:
    """The columns `time` (s) and `position` (in `unit`: deg, rad, mm, m) of a CSV, text or MATLAB file, every `dt` s.

    Between samples the path is a straight line; `held`: each sample is a set point until the next. Raises
    MeasuredDataError for a file, a column or times that cannot be used, UnitError for a unit that is none of a position.
    """
    table = read_table(path)
    at, values = table.column(time), table.column(position)
    check_time(at, f"{table.path}: column {table.name_of(time)!r}", place=table.place)
    values = convert(values, unit, "rad" if unit in ("deg", "rad", "degree", "degrees", "mrad") else "m")
    # A sample that rounding put a hair before a set point belongs after it.
    wanted = at[0] + np.asarray(clock(float(at[-1] - at[0]), dt))
    if held:
        return resting(jnp.asarray(values[np.maximum(np.searchsorted(at, wanted + 1e-9, side="right") - 1, 0)]))
    return sampled(jnp.asarray(np.interp(wanted, at, values)), dt)
