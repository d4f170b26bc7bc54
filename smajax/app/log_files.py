"""Measured logs in a folder: which there are, what is in each, and a new one from the browser."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import IO

import numpy as np

from smajax.app.confined import is_inside
from smajax.core.files import writing
from smajax.core.units import UnitError, convert
from smajax.data.experiment.column_guess import TIME, Column, columns_of
from smajax.data.readers.read import READERS, read_table
from smajax.data.readers.table import MeasuredDataError, Table

UPLOADS = "logs"  # the folder of what a browser brings
PIECE = 1 << 20  # bytes


@dataclass(frozen=True)
class Log:
    """One log: what its columns may be, and its length; or why it cannot be read.

    own: path relative to the project's folder.
    """

    own: str
    columns: tuple[Column, ...] = ()
    samples: int = 0
    seconds: float | None = None
    error: str = ""

    @property
    def name(self) -> str:
        return Path(self.own).stem


def found_in(root: Path, folder: Path, results: Sequence[str]) -> tuple[Path, ...]:
    """Logs in `folder` and in the folders right below it, but for those of `results`; none that leads out of `root`."""

    def walk() -> Iterator[Path]:
        for one in sorted(folder.iterdir()):
            if one.name.startswith("."):
                continue
            if one.is_dir() and one.name not in results and is_inside(root, one):
                yield from (two for two in sorted(one.iterdir()) if two.is_file() and not two.name.startswith("."))
            elif one.is_file():
                yield one

    try:
        return tuple(one for one in walk() if one.suffix.lower() in READERS and is_inside(root, one))
    except OSError:
        return ()


def stamp(path: Path) -> tuple[str, int, int]:
    """What changes when a file does."""
    try:
        found = path.stat()
    except OSError:
        return str(path), 0, 0
    return str(path), found.st_mtime_ns, found.st_size


@lru_cache(maxsize=16)
def _table(at: tuple[str, int, int], decimal: str) -> Table:
    return read_table(at[0], decimal=decimal or None)


def table_of(path: Path, decimal: str = "") -> Table:
    """The log, read once as long as the file stays the same. Raises MeasuredDataError."""
    return _table(stamp(path), decimal)


def log_of(folder: Path, path: Path, decimal: str = "") -> Log:
    """The log `path` of a project in `folder`."""
    own = Path(os.path.relpath(path, folder)).as_posix()
    try:
        table = table_of(path, decimal)
        columns = tuple(columns_of(table))
    except MeasuredDataError as error:
        return Log(own, error=str(error).replace(f"{path}", path.name))
    time = time_of(table, columns[0].name) if columns else None
    size = max((values.size for values in table.columns.values()), default=0)
    return Log(own, columns, size, None if time is None or not time.size else float(np.ptp(time)))


def time_of(table: Table, column: str) -> np.ndarray | None:
    """Times of the samples of a column, s, from its own clock or from the column that is the time; None where there is none."""
    clock = table.clocks.get(column)
    if clock is not None:
        return np.asarray(clock)
    time = next((one for one in columns_of(table) if one.quantity == TIME), None)
    if time is None:
        return None
    try:
        return convert(table.columns[time.name], time.unit, "s")
    except UnitError:
        return None


def safe_name(name: str) -> str:
    """The name of a file from a browser without folders and without what a shell or a link would stumble over."""
    plain = re.sub(r"[^\w.\- ()+]", "_", Path(name.replace("\\", "/")).name).strip(" .")
    return plain or "log"


def receive(folder: Path, name: str, content: IO[bytes]) -> Path:
    """Write a log that a browser sends into `folder`/logs and read it once. Raises MeasuredDataError; then nothing is left of it.

    The same file again is no error; another one of the same name is.
    """
    target = folder / UPLOADS / safe_name(name)
    if target.suffix.lower() not in READERS:
        read_table(target)  # says which endings there are
    if target.exists():
        content.seek(0)
        if target.read_bytes() != content.read():
            raise MeasuredDataError(
                f"{target.name}: {UPLOADS}/ has another file of this name already; rename one of them"
            )
        return target
    target.parent.mkdir(exist_ok=True)
    content.seek(0)
    with writing(target) as file:
        while piece := content.read(PIECE):
            file.write(piece)
    try:
        table_of(target)
    except MeasuredDataError as error:
        target.unlink()
        raise MeasuredDataError(str(error).replace(str(target), target.name)) from None
    return target
