"""Text tables: comma, tab, semicolon or whitespace separated, with decimal points or commas, with or without a header line."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from smajax.measured.table import Array, MeasuredDataError, Table

COMMENT_MARKS = ("#", "%")
# In this order, because a column may hold decimal commas where another mark separates.
SEPARATORS = ("\t", ";", ",")
# A number with a decimal comma, and one of these that may as well be thousands.
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
MISSING = ("", "na", "n/a")  # cells without a sample, where the experiment file allows them; nan is a number to Python


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


def _separator(lines: Sequence[str]) -> str | None:
    """The mark that separates the cells; None for whitespace.

    The bulk of the data lines decides: a header may hold commas in a whitespace-separated file, and one line that is
    cut short holds no mark at all. A header alone is asked when there is nothing else.
    """
    asked = lines[1:] or lines
    if 2 * sum(_blank_separated(line) for line in asked) > len(asked):
        return None
    return next((mark for mark in SEPARATORS if 2 * sum(mark in line for line in asked) > len(asked)), None)


def _blank_separated(line: str) -> bool:
    """Whether blanks separate numbers with decimal commas, so that the commas do not separate: `0,5 1,25`."""
    cells = line.split()
    numbers = sum(DECIMAL_COMMA.fullmatch(cell) is not None for cell in cells)
    return len(cells) > 1 and numbers > 0 and all(DECIMAL_COMMA.fullmatch(cell) or _is_number(cell) for cell in cells)


def _with_points(rows: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Cells with decimal commas as numbers, in a file that has no decimal points and where they cannot be thousands."""
    cells = [cell for _, row in rows for cell in row]
    commas = [cell for cell in cells if DECIMAL_COMMA.fullmatch(cell)]
    points = any("." in cell and _is_number(cell) for cell in cells)
    if not commas or points or all(THOUSANDS.fullmatch(cell) for cell in commas):
        return rows
    return [
        (number, [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell for cell in row])
        for number, row in rows
    ]


def _rows(text: str) -> list[tuple[int, list[str]]]:
    """(line number from 1, cells) of every line that is neither blank nor a comment."""
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith(COMMENT_MARKS)
    ]
    if not lines:
        return []
    separator = _separator([line for _, line in lines])
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


def _cells(count: int) -> str:
    return f"{count} cell" if count == 1 else f"{count} cells"


def _usual_width(rows: Sequence[tuple[int, list[str]]], header: Sequence[str] | None) -> int:
    """How many cells most lines have; of two counts that are as frequent, the header's, then the first line's."""
    counts = Counter(len(cells) for _, cells in rows)
    most = max(counts.values())
    usual = [width for width, count in counts.items() if count == most]
    return len(header) if header is not None and len(header) in usual else usual[0]


def _is_units(rows: Sequence[tuple[int, list[str]]]) -> bool:
    """Whether the first of the lines names units ("ms", "V", "-", "1") and the one after it holds numbers."""
    if len(rows) < 2:
        return False
    first, second = rows[0][1], rows[1][1]
    words = [cell for cell in first if cell not in ("", "-", "1")]
    return bool(words) and not any(map(_is_number, words)) and any(map(_is_number, second))


def _why_unusable(name: str, place: int, rows: Sequence[tuple[int, list[str]]], units: bool) -> str | None:
    """What keeps the column at that place from being numbers, or None. units: the first line looks like units."""
    wrong = next(((number, row[place]) for number, row in rows if not _is_number(row[place])), None)
    if wrong is None:
        return None
    number, cell = wrong
    got = f"line {number}, column {name!r}: " + (f"{cell!r} is not a number" if cell else "the cell is empty")
    if units and number == rows[0][0] and all(_is_number(row[place]) for _, row in rows[1:]):
        return f"{got}; line {number} looks like units: delete it"
    hint = "; its comma may be decimal or set thousands apart: write a decimal point" if "," in cell else ""
    return f"{got}{hint}; expected a number in every line"


def read_csv(path: Path) -> Table:
    """Reads a text table. The first line is a header when one of its cells is not a number.

    Columns are named by the header, or "1", "2", ... without one. A column with a cell that is not a number is
    an error only when it is asked for. Raises MeasuredDataError.
    """
    rows = _with_points(_rows(_text(path)))
    if not rows:
        raise MeasuredDataError(f"{path}: holds no data line")
    header: list[str] | None = None
    if not all(_is_number(cell) for cell in rows[0][1] if cell):
        header, rows = rows[0][1], rows[1:]
        if not rows:
            raise MeasuredDataError(f"{path}: holds a header and no data line")
    width = _usual_width(rows, header)
    if header is not None and len(header) != width:
        number = next(number for number, cells in rows if len(cells) == width)
        raise MeasuredDataError(
            f"{path}: the header has {_cells(len(header))} ({header}) and line {number} has {width}; "
            "expected as many names as columns"
        )
    for number, cells in rows:
        if len(cells) != width:
            raise MeasuredDataError(
                f"{path}: line {number} has {_cells(len(cells))}, expected {width} as in the other lines; "
                "complete the line or delete it"
            )

    names = header if header is not None else [str(number) for number in range(1, width + 1)]
    names = [name or str(number) for number, name in enumerate(names, start=1)]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise MeasuredDataError(f"{path}: column name(s) {repeated} given more than once; rename them")
    columns: dict[str, Array] = {}
    unusable: dict[str, str] = {}
    gappy: dict[str, Array] = {}
    units = header is not None and _is_units(rows)
    for place, name in enumerate(names):
        reason = _why_unusable(name, place, rows, units)
        if reason is None:
            columns[name] = np.array([row[place] for _, row in rows], dtype=np.float64)
        else:
            unusable[name] = reason
            if all(cell.lower() in MISSING or _is_number(cell) for cell in (row[place] for _, row in rows)):
                cells = [row[place] for _, row in rows]
                gappy[name] = np.array([np.nan if cell.lower() in MISSING else float(cell) for cell in cells])
    if not columns:
        raise MeasuredDataError(f"{path}: no column of numbers; {unusable[names[0]]}")
    lines = tuple(number for number, _ in rows)
    return Table(path=path, columns=columns, unusable=unusable, gappy=gappy, order=tuple(names), lines=lines)
