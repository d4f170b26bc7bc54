"""Text tables: comma, tab, semicolon or whitespace separated, with or without a header line."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from smajax.measured.table import Array, MeasuredDataError, Table

COMMENT_MARKS = ("#", "%")


def _text(path: Path) -> str:
    data = path.read_bytes()
    if data.startswith(b"MATLAB 5.0") or data.startswith(b"\x89HDF"):
        raise MeasuredDataError(f"{path}: is a MATLAB file, not the text that its suffix says; rename it to .mat")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data:
        raise MeasuredDataError(f"{path}: is not the text that its suffix says (it holds binary data)")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")  # every byte is a character there: a header's degree sign must not stop the run


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """(line number from 1, cells) of every line that is neither blank nor a comment."""
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(COMMENT_MARKS)
    ]
    if not lines:
        return []
    # The last line, because a header may hold commas in a whitespace-separated file.
    separator = next((mark for mark in ("\t", ";", ",") if mark in lines[-1][1]), None)
    if separator is None:
        return [(number, line.split()) for number, line in lines]
    rows = [(number, next(csv.reader([line], delimiter=separator, skipinitialspace=True))) for number, line in lines]
    return [(number, [cell.strip() for cell in cells]) for number, cells in rows]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def read_csv(path: Path) -> Table:
    """Reads a text table. The first line is a header when one of its cells is not a number.

    Columns are named by the header, or "1", "2", ... without one. A column with a cell that is not a number is
    an error only when it is asked for. Raises MeasuredDataError.
    """
    rows = _rows(_text(path))
    if not rows:
        raise MeasuredDataError(f"{path}: holds no data line")
    header: list[str] | None = None
    if not all(_is_number(cell) for cell in rows[0][1] if cell):
        header, rows = rows[0][1], rows[1:]
        if not rows:
            raise MeasuredDataError(f"{path}: holds a header and no data line")
    width = len(rows[0][1])
    if header is not None and len(header) != width:
        raise MeasuredDataError(
            f"{path}: the header has {len(header)} cells ({header}) and line {rows[0][0]} has {width}; "
            "expected as many names as columns"
        )
    for number, cells in rows:
        if len(cells) != width:
            raise MeasuredDataError(f"{path}: line {number} has {len(cells)} cells, expected {width} as above")

    names = header if header is not None else [str(number) for number in range(1, width + 1)]
    names = [name or str(number) for number, name in enumerate(names, start=1)]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise MeasuredDataError(f"{path}: column name(s) {repeated} given more than once; rename them")
    columns: dict[str, Array] = {}
    unusable: dict[str, str] = {}
    for place, name in enumerate(names):
        cells = [row[place] for _, row in rows]
        wrong = next((at for at, cell in enumerate(cells) if not _is_number(cell)), None)
        if wrong is None:
            columns[name] = np.array(cells, dtype=np.float64)
            continue
        cell = cells[wrong]
        hint = "; write a decimal point, not a comma" if "," in cell else ""
        got = f"{cell!r} is not a number" if cell else "the cell is empty"
        unusable[name] = f"line {rows[wrong][0]}, column {name!r}: {got}{hint}; expected a number in every line"
    if not columns:
        raise MeasuredDataError(f"{path}: no column of numbers; {unusable[names[0]]}")
    return Table(path=path, columns=columns, unusable=unusable, order=tuple(names))
