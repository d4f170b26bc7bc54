"""Inputs as people write them: `6V:5s,0V:10s`, a constant `25 degC`, or a column of a file `log.csv:U:mV`, `log.csv:U:mV:held`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from smajax.core.units import UnitError, convert, parse_quantity
from smajax.data.readers.headers import time_column, unit_of
from smajax.data.readers.read import READERS, read_table
from smajax.data.readers.resample import resample_input, resample_output, uniform_clock
from smajax.data.readers.table import Array, MeasuredDataError, Table, check_time

MOST_SAMPLES = 20_000_000
HELD = ":held"  # behind a column of a file: each row holds until the next one


@dataclass(frozen=True)
class Given:
    """One input: samples (time (s), values (own unit)), each held until the next; a constant has one and no `seconds`."""

    time: Array
    values: Array
    seconds: float | None  # how long it lasts
    measured: bool = False  # samples of a file, with straight lines between them where values at instants are taken

    def between(self, clock: Array) -> Array:
        """On straight lines between the samples, from the last one on as it is, shape (n,)."""
        return np.asarray(np.interp(clock, self.time, self.values))

    def at(self, clock: Array) -> Array:
        """The sample that holds at each instant, shape (n,)."""
        # An instant that rounding put a hair before a sample belongs after it.
        return np.asarray(self.values[np.clip(np.searchsorted(self.time, clock + 1e-9, side="right") - 1, 0, None)])

    def on(self, clock: Array, dt: float, *, squared: bool = False, sampled: bool = False) -> Array:
        """On a uniform clock, shape (n,): a command's mean over each step, or (`sampled`) a measured value at each instant.

        squared: see `resample_input`.
        """
        if self.seconds is None or (sampled and not self.measured):
            return self.at(clock)
        if sampled:
            return resample_output(self.time, self.values, clock, dt).values
        return resample_input(self.time, self.values, clock, dt, squared=squared)


def _check_commas(parts: Sequence[str]) -> None:
    """UnitError where a comma stands between two digits and leaves a part without a colon: `6,5V:2s`, `6V:2,5s`."""
    for left, right in pairwise(parts):
        if left[-1:].isdigit() and right[:1].isdigit() and not (":" in left and ":" in right):
            raise UnitError(
                f"got '{left},{right}', expected a decimal point, as in '{left}.{right}': a comma stands between levels, "
                "such as '6.5V:5s,0V:10s'"
            )


def levels(text: str, unit: str, bare: str = "") -> Given:
    """`LEVEL:TIME,LEVEL:TIME,...`, such as `6V:5s,0V:10s`. UnitError for what it cannot be read as.

    bare: the unit of levels without one, times are then s; empty: each must say its own.
    """
    values, lengths = [], []
    parts = text.split(",")
    _check_commas(parts)
    for part in parts:
        level, colon, length = part.rpartition(":")
        if not colon:
            within = "" if part.strip() else f" in {text!r}, nothing between two commas"
            raise UnitError(f"got {part.strip()!r}{within}, expected LEVEL:TIME, such as '6V:5s'")
        try:
            values.append(parse_quantity(level, unit, bare=bare))
            lengths.append(parse_quantity(length, "s", bare="s" if bare else ""))
        except UnitError as error:
            raise UnitError(f"{part.strip()!r}: {error}") from None
    if min(lengths) <= 0.0:
        raise UnitError(f"got {text!r}, expected times above zero")
    ends = np.cumsum(lengths)
    return Given(np.concatenate([[0.0], ends[:-1]]), np.asarray(values), float(ends[-1]))


def reads_file(text: str) -> bool:
    """Whether an input is a column of a file."""
    head, colon, _ = text.partition(":")
    return bool(colon) and (Path(head).suffix.lower() in READERS or Path(head).is_file())


def _time(table: Table, time: str) -> tuple[Array, str, str]:
    """(values, name, unit) of the column that `COLUMN` or `COLUMN:UNIT` names, or its heading. Raises MeasuredDataError."""
    level, _, unit = time.partition(":")
    try:
        key = int(level) if level.isdigit() and level not in table.columns else level
        name = table.name_of(key) if level else time_column(table)
    except MeasuredDataError as error:
        how = "a time column is named by --time, as COLUMN or COLUMN:UNIT; how long a run is says --seconds"
        raise MeasuredDataError(f"{error}; {how}") from None
    return table.column(name), name, unit or unit_of(table, name) or "s"


def column(path: Path, key: str | int, unit: str, own: str, time: str = "") -> Given:
    """A column of a measured file; time counts from its first sample.

    unit: of the column; empty: what its header says, else the message asks for it. time: `COLUMN` or `COLUMN:UNIT`, by
    default the one that its header names. Raises MeasuredDataError, UnitError.
    """
    table = read_table(path)
    values = table.column(key)
    written = unit or unit_of(table, table.name_of(key))
    if not written and own not in ("1", "-"):
        raise UnitError(
            f"{path}: column {table.name_of(key)!r} does not say its unit; write it behind: {path.name}:{key}:{own}"
        )
    clock, clock_unit, where = table.clock(key), "s", f"the time of {key!r}"
    if clock is None:
        clock, name, clock_unit = _time(table, time)
        where = f"the time column {name!r}"
    check_time(clock, f"{path}: {where}", clock_unit, table.place)
    try:
        seconds = convert(clock, clock_unit, "s")
    except UnitError as error:
        raise UnitError(f"{path}: {where}: {error}") from None
    seconds = seconds - seconds[0]
    return Given(seconds, convert(values, written or own, own), float(seconds[-1]), measured=True)


def given(text: str, own: str, time: str = "", bare: str = "") -> Given:
    """An input from text: levels, a constant, or `FILE:COLUMN` and `FILE:COLUMN:UNIT`; `own` is the unit that it comes in.

    bare: see `levels`; a file's column without a unit is asked for one. `FILE:COLUMN:UNIT:held`: each row holds until the next one.
    """
    head, colon, rest = text.partition(":")
    if reads_file(text):
        name, _, unit = rest.removesuffix(HELD).partition(":")
        key: str | int = int(name) if name.isdigit() else name
        found = column(Path(head), key, unit, own, time)
        return replace(found, measured=not rest.endswith(HELD))
    if not colon and reads_file(f"{text}:"):
        raise UnitError(
            f"got the file {text!r} without a column, expected FILE:COLUMN:UNIT, such as {Path(text).name}:COLUMN:{bare or own}"
        )
    if colon or "," in text:
        return levels(text, own, bare)
    return Given(np.zeros(1), np.asarray([parse_quantity(text, own, bare=bare)]), None)


def length_of(several: Sequence[Given], seconds: float | None) -> float:
    """How long a run is, s: as long as asked, or as its longest input. ValueError where nothing says how long."""
    lasting = [one.seconds for one in several if one.seconds is not None]
    if seconds is None and not lasting:
        raise ValueError(
            "nothing says how long the run is: give levels with times (6V:5s,0V:10s), a file, or --seconds."
        )
    return max(lasting) if seconds is None else seconds


def clock_of(several: Sequence[Given], seconds: float | None, dt: float) -> Array:
    """t_0 ... t_n of a run as long as `length_of`, in whole steps. ValueError as there, and for no step or too many."""
    end = length_of(several, seconds)
    if not end / dt <= MOST_SAMPLES:
        raise ValueError(
            f"{end:g} s at {dt:g} s are over {MOST_SAMPLES:,} samples: take a longer --dt or a shorter run."
        )
    if end < dt:
        raise ValueError(
            f"the run lasts {end:g} s, less than a step of {dt:g} s: take a shorter --dt or a longer run, or "
            "correct the unit of the times."
        )
    return uniform_clock(0.0, end, dt)
