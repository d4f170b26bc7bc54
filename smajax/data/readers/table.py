"""Table: the columns of one measured file, and the checks that hold for all file kinds."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smajax.core.names import close_matches

Array = NDArray[np.float64]


class MeasuredDataError(ValueError):
    """A measured file that is missing, is not what it says, or holds what cannot be used."""


class NoColumnError(MeasuredDataError):
    """A column that the file does not have. key: as it was asked for."""

    def __init__(self, message: str, key: str | int) -> None:
        super().__init__(message)
        self.key = key


def _counted(index: int) -> str:
    return f"sample {index + 1}"


@dataclass(frozen=True)
class Table:
    """Named signals of one file.

    columns: name -> (n,) values in the file's own units; lengths may differ in a .mat file.
    clocks: name -> (n,) times of that signal, seconds, for the signals that carry their own.
    unusable: name -> why that column holds no signal; it is an error only when the column is asked for.
    gappy: of the unusable, those that hold a signal once empty cells are taken as missing: name -> (n,) with nan there.
    units: name -> the unit that the file itself states beside its name, for those that have one.
    labels: name -> what the file calls the signal beside its name, for those that have one.
    moments: of columns that the file has as clock times: name -> the first one in ns, since when `columns` counts seconds.
    lines: the line of the file, counted from 1, that each sample is from; empty where samples have no lines.
    """

    path: Path
    columns: Mapping[str, Array]
    clocks: Mapping[str, Array] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)
    gappy: Mapping[str, Array] = field(default_factory=dict)
    order: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    moments: Mapping[str, int] = field(default_factory=dict)
    lines: Sequence[int] = ()

    def place(self, index: int) -> str:
        """Where in the file the sample with that index, counted from 0, is: what an editor shows, where there is one."""
        return f"line {self.lines[index]}" if len(self.lines) else _counted(index)

    def name_of(self, key: str | int, taken: Collection[str | int] = ()) -> str:
        """The column that `key` means: its name, or its number counted from 1. Raises MeasuredDataError.

        taken: columns with another meaning already, which an error does not suggest.
        """
        names = self.order or (*self.columns, *self.unusable)
        if isinstance(key, int):
            if 1 <= key <= len(names):
                return names[key - 1]
            raise NoColumnError(f"{self.path}: no column number {key}; it has columns 1 to {len(names)}", key)
        if key in self.columns or key in self.unusable:
            return key
        free = [name for number, name in enumerate(names, start=1) if name not in taken and number not in taken]
        raise NoColumnError(f"{self.path}: no column {key!r}{close_matches(key, names, 'it has', free)}", key)

    def column(self, key: str | int, taken: Collection[str | int] = (), gaps: bool = False) -> Array:
        """The values of one column, shape (n,), all finite or, with `gaps`, nan where a sample is missing.

        taken: see `name_of`. Raises MeasuredDataError.
        """
        name = self.name_of(key, taken)
        if name in self.unusable and not (gaps and name in self.gappy):
            raise MeasuredDataError(f"{self.path}: {self.unusable[name]}")
        values = self.gappy[name] if name in self.unusable else self.columns[name]
        if values.size == 0:
            raise MeasuredDataError(f"{self.path}: column {name!r} is empty; expected at least two samples")
        bad = np.flatnonzero(np.isinf(values) if gaps else ~np.isfinite(values))
        if bad.size:
            raise MeasuredDataError(
                f"{self.path}: column {name!r} has {bad.size} value(s) that are not finite, the first is "
                f"{values[bad[0]]} in {self.place(int(bad[0]))}; remove or repair those samples"
            )
        return values

    def with_gaps(self) -> Table:
        """The table in which columns that only lack some samples are columns, with nan there."""
        held = {name: why for name, why in self.unusable.items() if name not in self.gappy}
        return replace(self, columns={**self.columns, **self.gappy}, unusable=held, gappy={})

    def has_gaps(self, key: str | int) -> bool:
        """Whether the column holds a signal once cells that are empty or nan are taken as missing samples."""
        name = self.name_of(key)
        return name in self.gappy or bool(name in self.columns and np.isnan(self.columns[name]).any())

    def clock(self, key: str | int) -> Array | None:
        """The times that the signal itself carries, shape (n,), seconds; None when it carries none."""
        name = self.name_of(key)
        return self.clocks.get(name)


def check_time(time: Array, where: str, unit: str = "s", place: Callable[[int], str] = _counted) -> None:
    """Raises MeasuredDataError unless `time`, shape (n,), is finite and increases from each sample to the next.

    where: the file and what in it the time is. unit: of `time`, as its file has it. place: index -> "line 12".
    """
    if time.size < 2:
        raise MeasuredDataError(f"{where}: {time.size} sample(s); expected at least two")
    if not np.all(np.isfinite(time)):
        at = int(np.flatnonzero(~np.isfinite(time))[0])
        raise MeasuredDataError(f"{where} is {time[at]} in {place(at)}; expected finite times")
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if wrong.size:
        at = int(wrong[0]) + 1
        more = f" and at {wrong.size - 1} other place(s)" if wrong.size > 1 else ""
        raise MeasuredDataError(
            f"{where} does not increase at {place(at)} ({time[at - 1]:.9g} {unit} then {time[at]:.9g} {unit}){more}; "
            "sort the samples, remove repeated ones or split the run there"
        )
