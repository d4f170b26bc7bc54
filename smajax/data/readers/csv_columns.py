"""Columns of a text table as they are read: numbers or clock times, and the reason why a column is neither."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from smajax.data.readers.clock_times import NANO, moment, past_midnight
from smajax.data.readers.table import Array

MISSING = ("", "na", "n/a")  # cells without a sample, where the experiment file allows them; nan is a number to Python


def is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def is_datum(cell: str) -> bool:
    """Whether a cell holds a number or a clock time."""
    return is_number(cell) or moment(cell) is not None


def _why_unusable(
    name: str, place: int, rows: Sequence[tuple[int, list[str]]], reads: Callable[[str], bool], what: str
) -> str | None:
    """What keeps the column at that place from being a signal, or None. reads: whether a cell is `what` it should hold."""
    wrong = next(((number, row[place]) for number, row in rows if not reads(row[place])), None)
    if wrong is None:
        return None
    number, cell = wrong
    got = f"line {number}, column {name!r}: " + (f"{cell[:40]!r} is not a {what}" if cell else "the cell is empty")
    hint = ""
    if "," in cell:
        hint = (
            "; its comma may be decimal or set thousands apart: write a decimal point, or decimal = ',' under [data] "
        )
        hint += "(`smajax new-experiment --decimal ,`)"
    return f"{got}{hint}; expected a {what} in every line"


class CsvColumn:
    """One column as it is read: its numbers or clock times a block at a time, and what keeps it from being either."""

    def __init__(self, name: str, place: int, clock: bool) -> None:
        self.name, self.place = name, place
        self.clock = clock  # whether it holds clock times
        self.parts: list[Array] = []
        self.first: int | None = None  # clock time, ns, since when seconds are counted
        self.reason: str | None = None
        self.gappy = True  # whether a missing sample is all that keeps it from being numbers
        self.beyond_first = 0  # cells that are no numbers, but for the first line's

    def reads(self, cell: str) -> bool:
        return moment(cell) is not None if self.clock else is_number(cell)

    def add_numbers(self, values: Array) -> None:
        self.parts.append(np.ascontiguousarray(values))

    def add(self, rows: Sequence[tuple[int, list[str]]], first: bool) -> None:
        """first: these rows begin the file."""
        reason = _why_unusable(self.name, self.place, rows, self.reads, "clock time" if self.clock else "number")
        self.reason = self.reason or reason
        cells = [row[self.place] for _, row in rows]
        if reason is not None:
            self.beyond_first += sum(not self.reads(cell) for cell in cells[1 if first else 0 :])
            self.gappy = self.gappy and all(cell.lower() in MISSING or self.reads(cell) for cell in cells)
        if not self.gappy:
            self.parts.clear()
        elif self.clock:
            moments = [moment(cell) for cell in cells]
            if self.first is None:
                self.first = moments[0] or 0  # a column is a clock by its first cell
            origin = self.first
            self.parts.append(np.array([np.nan if one is None else (one - origin) / NANO for one in moments]))
        else:
            self.parts.append(np.array([float(cell) if is_number(cell) else np.nan for cell in cells]))

    @property
    def values(self) -> Array:
        values = np.concatenate(self.parts) if self.parts else np.zeros(0)
        return values if self.first is None else past_midnight(values, self.first)
