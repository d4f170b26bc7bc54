"""Table: the columns of one measured file, and the checks that hold for all file kinds."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LISTED = 20


class MeasuredDataError(ValueError):
    """A measured file that is missing, is not what it says, or holds what cannot be used."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A sentence part that suggests the known name closest to `name`; empty when none is close."""
    names = [str(one) for one in known]
    lower = {one.lower(): one for one in reversed(names)}
    close = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.5)
    return f"; did you mean {lower[close[0]]!r}?" if close else ""


def listed(names: Iterable[str]) -> str:
    """The names in one line, the first twenty at most."""
    all_names = [str(name) for name in names]
    more = f", and {len(all_names) - LISTED} more" if len(all_names) > LISTED else ""
    return (", ".join(all_names[:LISTED]) + more) or "none"


@dataclass(frozen=True)
class Table:
    """Named signals of one file.

    columns: name -> (n,) values in the file's own units; lengths may differ in a .mat file.
    clocks: name -> (n,) times of that signal, seconds, for the signals that carry their own.
    unusable: name -> why that column holds no signal; it is an error only when the column is asked for.
    """

    path: Path
    columns: Mapping[str, Array]
    clocks: Mapping[str, Array] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)
    order: tuple[str, ...] = ()

    def name_of(self, key: str | int) -> str:
        """The column that `key` means: its name, or its number counted from 1. Raises MeasuredDataError."""
        names = self.order or (*self.columns, *self.unusable)
        if isinstance(key, int):
            if 1 <= key <= len(names):
                return names[key - 1]
            raise MeasuredDataError(f"{self.path}: no column number {key}; it has columns 1 to {len(names)}")
        if key in self.columns or key in self.unusable:
            return key
        raise MeasuredDataError(f"{self.path}: no column {key!r}; it has: {listed(names)}{nearest(key, names)}")

    def column(self, key: str | int) -> Array:
        """The values of one column, shape (n,), all finite. Raises MeasuredDataError."""
        name = self.name_of(key)
        if name in self.unusable:
            raise MeasuredDataError(f"{self.path}: {self.unusable[name]}")
        values = self.columns[name]
        if values.size == 0:
            raise MeasuredDataError(f"{self.path}: column {name!r} is empty; expected at least two samples")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise MeasuredDataError(
                f"{self.path}: column {name!r} has {bad.size} value(s) that are not finite, the first is "
                f"{values[bad[0]]} in sample {bad[0] + 1}; remove or repair those samples"
            )
        return values

    def clock(self, key: str | int) -> Array | None:
        """The times that the signal itself carries, shape (n,), seconds; None when it carries none."""
        name = self.name_of(key)
        return self.clocks.get(name)


def check_time(time: Array, where: str) -> None:
    """Raises MeasuredDataError unless `time`, shape (n,), is finite and increases from each sample to the next."""
    if time.size < 2:
        raise MeasuredDataError(f"{where}: {time.size} sample(s); expected at least two")
    if not np.all(np.isfinite(time)):
        at = int(np.flatnonzero(~np.isfinite(time))[0])
        raise MeasuredDataError(f"{where}: time is {time[at]} in sample {at + 1}; expected finite times")
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if wrong.size:
        at = int(wrong[0]) + 1
        more = f" and at {wrong.size - 1} other place(s)" if wrong.size > 1 else ""
        raise MeasuredDataError(
            f"{where}: time does not increase at sample {at + 1} ({time[at - 1]:.9g} then {time[at]:.9g}){more}; "
            "sort the samples, remove repeated ones or split the run there"
        )
