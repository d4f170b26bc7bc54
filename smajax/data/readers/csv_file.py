"""Text tables: comma, tab, semicolon, bar or whitespace separated, with decimal points or commas, with or without a header line."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from smajax.core.units import is_unit
from smajax.data.readers.clock_times import moment
from smajax.data.readers.csv_columns import CsvColumn, is_datum, is_number
from smajax.data.readers.table import Array, MeasuredDataError, Table

COMMENT_MARKS = ("#", "%")
# In this order, because a column may hold decimal commas where another mark separates.
SEPARATORS = ("\t", ";", "|", ",")
# A number with a decimal comma, and one of these that may as well be thousands.
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
PREAMBLE = 100  # lines above a header
BLOCK = 20_000  # lines
CHUNK = 1 << 20  # bytes
LONGEST_LINE = 1 << 20  # characters


def _encoding(path: Path) -> str:
    """How the file's bytes are text. Raises MeasuredDataError where they are none; the file is never held as a whole."""
    with path.open("rb") as file:
        data = file.read(CHUNK)
        if data.startswith(b"MATLAB 5.0") or data.startswith(b"\x89HDF"):
            raise MeasuredDataError(f"{path}: is a MATLAB file, not the text that its suffix says; rename it to .mat")
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            return "utf-16"
        decoder, utf8 = codecs.getincrementaldecoder("utf-8")(), True
        while data:
            if b"\0" in data:
                raise MeasuredDataError(f"{path}: is not the text that its suffix says (it holds binary data)")
            following = file.read(CHUNK)
            try:
                if utf8:
                    decoder.decode(data, final=not following)
            except UnicodeDecodeError:
                utf8 = False
            data = following
    # Every byte is a character in Latin-1: a header's degree sign must not stop the run.
    return "utf-8-sig" if utf8 else "latin-1"


def _blocks(path: Path) -> Iterator[list[tuple[int, str]]]:
    """(line number from 1, line) of every line that is neither blank nor a comment, at most BLOCK of them at a time."""
    block: list[tuple[int, str]] = []
    with path.open(encoding=_encoding(path), errors="replace") as file:
        number = 0
        while line := file.readline(LONGEST_LINE):
            number += 1
            if len(line) == LONGEST_LINE:
                raise MeasuredDataError(
                    f"{path}: line {number} is longer than {LONGEST_LINE:,} characters; expected a line of numbers a sample"
                )
            if line.strip() and not line.lstrip().startswith(COMMENT_MARKS):
                block.append((number, line))
            if len(block) == BLOCK:
                yield block
                block = []
    if block:
        yield block


def _separator(path: Path, lines: Sequence[str], decimal: str | None) -> str | None:
    """The mark that separates the cells; None for whitespace. Raises MeasuredDataError where it is said to be the decimal one.

    The bulk of the data lines decides: a header may hold commas in a whitespace-separated file, and one line that is
    cut short holds no mark at all. A header alone is asked when there is nothing else.
    """
    candidates = lines[1:] or lines
    if 2 * sum(_blank_separated(line) for line in candidates) > len(candidates):
        return None
    mark = next((mark for mark in SEPARATORS if 2 * sum(mark in line for line in candidates) > len(candidates)), None)
    if decimal is None or mark != decimal or '"' in candidates[0]:  # in quotes a cell may hold the mark
        return mark
    if "," in lines[0] and not DECIMAL_COMMA.fullmatch(lines[0].strip()):
        raise MeasuredDataError(
            f"{path}: commas separate its cells ({lines[0].strip()[:40]!r}), and [data] decimal = ',' says that they are decimal; take "
            "that key out"
        )
    return ";"  # one column, whose heading may hold blanks


def _blank_separated(line: str) -> bool:
    """Whether blanks separate numbers with decimal commas, so that the commas do not separate: `0,5 1,25`."""
    cells = line.split()
    if [cell.strip() for cell in line.split("\t")] == cells:
        return False  # one tab between any two: so they may be between the words of a header
    numbers = sum(DECIMAL_COMMA.fullmatch(cell) is not None for cell in cells)
    return len(cells) > 1 and numbers > 0 and all(DECIMAL_COMMA.fullmatch(cell) or is_datum(cell) for cell in cells)


def _has_decimal_commas(rows: list[tuple[int, list[str]]]) -> bool:
    """Whether the commas in cells are decimal: in a file that has no decimal points and where they cannot be thousands."""
    cells = [cell for _, row in rows for cell in row]
    commas = [cell for cell in cells if DECIMAL_COMMA.fullmatch(cell)]
    points = any("." in cell and is_number(cell) for cell in cells)
    return bool(commas) and not points and not all(THOUSANDS.fullmatch(cell) for cell in commas)


def _check_points(path: Path, rows: Sequence[tuple[int, list[str]]]) -> None:
    """Raises MeasuredDataError for a number with a point in a file whose decimals stand behind commas: 1.234 may be a thousand."""
    for number, row in rows:
        for cell in row:
            if "." in cell and is_number(cell):
                raise MeasuredDataError(
                    f"{path}: line {number} has {cell!r}, and [data] decimal = ',' says that decimals stand behind a comma; take that "
                    "key out, or write one mark in all cells"
                )


def _with_points(rows: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Cells with decimal commas as numbers."""
    return [
        (number, [cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell for cell in row])
        for number, row in rows
    ]


def _rows(path: Path, lines: list[tuple[int, str]], separator: str | None) -> list[tuple[int, list[str]]]:
    """(line number, cells) of each line."""
    if separator is None:
        return [(number, line.split()) for number, line in lines]
    rows = []
    for number, line in lines:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise MeasuredDataError(f"{path}: line {number} cannot be cut into cells ({error}); repair it") from error
        rows.append((number, [cell.strip() for cell in cells]))
    return rows


def _cells(count: int) -> str:
    return f"{count} cell" if count == 1 else f"{count} cells"


def _usual_width(rows: Sequence[tuple[int, list[str]]], header: Sequence[str] | None) -> int:
    """How many cells most lines have; of two counts that are as frequent, the header's, then the first line's."""
    counts = Counter(len(cells) for _, cells in rows)
    most = max(counts.values())
    usual = [width for width, count in counts.items() if count == most]
    return len(header) if header is not None and len(header) in usual else usual[0]


def _without_preamble(rows: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Without what a logger says of itself above the header: lines of another length than a header and the data below it.

    Where no line of names follows them, everything stays, for the message that says so.
    """
    width = _usual_width(rows, None)
    begins = next((place for place, (_, cells) in enumerate(rows[:PREAMBLE]) if len(cells) == width), 0)
    header = rows[begins][1]
    return rows[begins:] if width > 1 and not any(map(is_datum, header)) and all(header) else rows


def _is_units(rows: Sequence[tuple[int, list[str]]]) -> bool:
    """Whether the first of the lines names units ("ms", "V", "-", "1") and the one after it holds numbers."""
    if len(rows) < 2:
        return False
    first, second = rows[0][1], rows[1][1]
    words = [cell for cell in first if cell not in ("", "-", "1")]
    return bool(words) and not any(map(is_datum, words)) and any(map(is_number, second))


def _units(names: Sequence[str], cells: Sequence[str]) -> dict[str, str] | None:
    """Name -> unit by a line of units, `s;[mm];-`; None where a cell of it is none that is known."""
    bare = [cell.strip("[]() ") for cell in cells]
    if not all(not unit or is_unit(unit) for unit in bare):
        return None
    return {name: unit for name, unit in zip(names, bare, strict=True) if unit}


def _numbers(lines: list[tuple[int, str]], separator: str | None, width: int) -> Array | None:
    """All cells of a block of plain numbers, shape (lines, width), without looking at each; None where it is not that."""
    try:
        result = np.loadtxt([line for _, line in lines], delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        return None
    return result if result.shape == (len(lines), width) else None


def _checked_names(
    path: Path, header: list[str] | None, rows: Sequence[tuple[int, list[str]]], width: int
) -> list[str]:
    """The columns' names, each once. Raises MeasuredDataError."""
    if header is not None and len(header) != width:
        number = next(number for number, cells in rows if len(cells) == width)
        raise MeasuredDataError(
            f"{path}: the header has {_cells(len(header))} ({header}) and line {number} has {width}; "
            "expected as many names as columns"
        )
    names = header if header is not None else [str(number) for number in range(1, width + 1)]
    names = [name or str(number) for number, name in enumerate(names, start=1)]
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        raise MeasuredDataError(f"{path}: column name(s) {repeated} given more than once; rename them")
    return names


def _check_width(path: Path, rows: Sequence[tuple[int, list[str]]], width: int) -> None:
    for number, cells in rows:
        if len(cells) != width:
            raise MeasuredDataError(
                f"{path}: line {number} has {_cells(len(cells))}, expected {width} as in the other lines; "
                "complete the line or delete it"
            )


@dataclass(frozen=True)
class _Format:
    """How a text table is written, by its first lines."""

    path: Path
    separator: str | None  # None: whitespace
    decimal: str | None  # as requested
    commas: bool  # decimal commas
    names: tuple[str, ...]
    units: Mapping[str, str]  # of a line of units below the header
    unknown_units: bool  # the line below the header looks like units, and some are unknown

    def numbers(self, lines: list[tuple[int, str]]) -> Array | None:
        """The cells of a block, (lines, columns), without a check of each; None where they are not plain numbers."""
        return None if self.commas else _numbers(lines, self.separator, len(self.names))

    def rows(self, lines: list[tuple[int, str]]) -> list[tuple[int, list[str]]]:
        """(line number, cells) of each line of a block. Raises MeasuredDataError."""
        rows = _rows(self.path, lines, self.separator)
        if self.decimal == ",":
            _check_points(self.path, rows)
        rows = _with_points(rows) if self.commas else rows
        _check_width(self.path, rows, len(self.names))
        return rows


def _format(
    path: Path, lines: list[tuple[int, str]], decimal: str | None
) -> tuple[_Format, list[tuple[int, list[str]]]]:
    """(format, rows of data among the first lines). Raises MeasuredDataError."""
    separator = _separator(path, [line for _, line in lines], decimal)
    written = _rows(path, lines, separator)
    commas = decimal == "," if decimal is not None else _has_decimal_commas(written)
    rows = _without_preamble(_with_points(written) if commas else written)
    header: list[str] | None = None
    if not all(is_datum(cell) for cell in rows[0][1] if cell):
        header, rows = rows[0][1], rows[1:]
        if not rows:
            raise MeasuredDataError(f"{path}: holds a header and no data line")
    width = _usual_width(rows, header)
    names = _checked_names(path, header, rows, width)
    _check_width(path, rows, width)
    has_units = header is not None and _is_units(rows)
    units = _units(names, rows[0][1]) if has_units else None
    if units is not None:
        rows = rows[1:]
    if decimal == ",":
        _check_points(path, [row for row in written if row[0] >= rows[0][0]])
    unknown = has_units and units is None
    return _Format(path, separator, decimal, commas, tuple(names), units or {}, unknown), rows


def read_csv(path: Path, wanted: Collection[str | int] | None = None, decimal: str | None = None) -> Table:
    """Reads a text table. The first line is a header when one of its cells is neither a number nor a clock time.

    Columns are named by the header, or "1", "2", ... without one. A line of units under the header gives them theirs. Clock
    times are read as seconds from the first one. A column with a cell that is not a number is
    an error only when it is requested. wanted: the names and numbers (from 1) of the columns to keep; None: all.
    decimal: "," or "."; None: as the first lines show.
    The file is read in blocks of lines, of which the first determines the format; 8 bytes a number stay in memory.
    Raises MeasuredDataError.
    """
    blocks = _blocks(path)
    lines = next(blocks, [])
    if not lines:
        raise MeasuredDataError(f"{path}: holds no data line")
    form, rows = _format(path, lines, decimal)
    columns = [
        CsvColumn(name, place, moment(rows[0][1][place]) is not None)
        for place, name in enumerate(form.names)
        if wanted is None or name in wanted or place + 1 in wanted
    ]
    for column in columns:
        column.add(rows, first=True)
    numbers = [np.array([number for number, _ in rows])]
    clocks = any(column.clock for column in columns)
    for lines in blocks:
        values = None if clocks else form.numbers(lines)
        cells = form.rows(lines) if values is None else []
        for column in columns:
            if values is None:
                column.add(cells, first=False)
            elif column.gappy:
                column.add_numbers(values[:, column.place])
        numbers.append(np.array([number for number, _ in lines]))
    return _table(form, columns, rows[0][0], numbers, wanted is None)


def _table(
    form: _Format, columns: Sequence[CsvColumn], first_line: int, numbers: list[np.ndarray], all_columns: bool
) -> Table:
    """The table of the columns that were read. Raises MeasuredDataError where all were wanted and none has numbers."""
    signals: dict[str, Array] = {}
    unusable: dict[str, str] = {}
    gappy: dict[str, Array] = {}
    for column in columns:
        if column.reason is None:
            signals[column.name] = column.values
            continue
        unusable[column.name] = column.reason
        if form.unknown_units and not column.beyond_first:
            got = column.reason.split("; expected")[0]
            unusable[column.name] = f"{got}; line {first_line} looks like units: delete it"
        if column.gappy:
            gappy[column.name] = column.values
    if not signals and all_columns:
        raise MeasuredDataError(f"{form.path}: no column of numbers; {unusable[form.names[0]]}")
    moments = {column.name: column.first for column in columns if column.first is not None and column.name in signals}
    return Table(
        path=form.path,
        columns=signals,
        unusable=unusable,
        gappy=gappy,
        order=form.names,
        units={**form.units, **dict.fromkeys(moments, "s")},
        moments=moments,
        lines=_line_numbers(numbers),
    )


def _line_numbers(parts: list[np.ndarray]) -> Sequence[int]:
    """The line of each sample; a range where no line was passed over, which takes no memory."""
    first, last = int(parts[0][0]), int(parts[-1][-1])
    whole = range(first, last + 1)
    return whole if len(whole) == sum(map(len, parts)) else np.concatenate(parts)  # type: ignore[return-value]
