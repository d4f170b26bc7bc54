"""A measured or computed path in a file -> what the position should be."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from smajax.control.reference import Reference, clock, resting, sampled
from smajax.core.units import convert
from smajax.data.readers.read import read_table
from smajax.data.readers.table import check_time
from smajax.data.text_input import Given


def read_reference(
    path: str | Path, time: str | int, position: str | int, unit: str, dt: float, *, held: bool = False
) -> Reference:
    """The columns `time` (s) and `position` (in `unit`: deg, rad, mm, m) of a CSV, text or MATLAB file, every `dt` s.

    Between samples the path is a straight line; `held`: each sample is a set point until the next. So does `smajax simulate` of
    `--set-point FILE:COLUMN:UNIT`, and of `FILE:COLUMN:UNIT:held`. Raises
    MeasuredDataError for a file, a column or times that cannot be used, UnitError for a unit that is none of a position.
    """
    table = read_table(path)
    at, values = table.column(time), table.column(position)
    check_time(at, f"{table.path}: column {table.name_of(time)!r}", place=table.place)
    values = convert(values, unit, "rad" if unit in ("deg", "rad", "degree", "degrees", "mrad") else "m")
    # A sample that rounding put a hair before a set point belongs after it.
    wanted = at[0] + np.asarray(clock(float(at[-1] - at[0]), dt))
    return reference_of(Given(at, np.asarray(values), None, measured=not held), wanted, dt)


def reference_of(wanted: Given, clock: np.ndarray, dt: float) -> Reference:
    """The position wanted (rad or m) on a clock (s), `dt` s apart: samples of a file on straight lines, levels and held rows as set points.

    A set point holds from its instant on: a mean over the step before it would come early.
    """
    if wanted.measured:
        return sampled(jnp.asarray(wanted.between(clock)), dt)
    return resting(jnp.asarray(wanted.at(clock)))
