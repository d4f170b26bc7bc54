"""What a column's heading says: its unit, and whether it is the time."""

from __future__ import annotations

import re

from smajax.core.names import listed
from smajax.data.readers.table import MeasuredDataError, Table

BRACKETS = re.compile(r"[\[({]\s*([^\[\](){}]*(?:\([^()]*\)[^\[\](){}]*)?)\s*[\])}]\s*$")
# `Weg in µm`, `Weg, µm`; behind a blank alone, where a single letter may as well be a name: `Pos um`, not `Phase A`.
BEHIND = re.compile(r"^(.*\S)(?:\s+in\s+|\s*,\s*)(\S+)$|^(.*\S)\s+(\S{2,})$")
TIMES = {
    *("time", "t", "zeit", "temps", "tiempo", "timestamp", "elapsed", "seconds", "sec", "clock"),
    *("uhrzeit", "zeitstempel", "datetime", "date", "datum"),
}


def bare(name: str) -> str:
    """The heading without its unit in brackets or, as in DIN, behind a slash."""
    return _behind(BRACKETS.sub("", name).strip())[0]


def _behind(name: str) -> tuple[str, str]:
    """(the name, the unit) of a heading without brackets: the unit behind a word, a comma, a blank or a slash; else empty."""
    result = BEHIND.match(name.strip())
    if result is not None:
        before, unit = (result[1], result[2]) if result[1] else (result[3], result[4])
        if unit in SLASHED and unit not in ("1", "-"):
            return before, unit
    before, slash, unit = (part.strip() for part in name.partition("/"))
    return (before, unit) if slash and before and unit in ("", *SLASHED) else (name, "")


def words(name: str) -> list[str]:
    """The words of a heading, in small letters: `Wire_Temp2 [C]` -> wire, temp."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", bare(name))
    return [word for word in re.split(r"[\W\d_]+", apart.lower()) if word]


def unit_in(name: str) -> str:
    """The unit that a heading has in brackets at its end, `U [mV]` or `T (°C)`, behind a slash, `U/mV`, or behind an
    underscore, `time_s`; else empty."""
    result = BRACKETS.search(name)
    if result is not None:
        return result.group(1).strip()
    if unit := _behind(name)[1]:
        return unit
    tail = name.rsplit("_", 1)[-1] if "_" in name else ""
    return tail if tail in TAILS else ""


def unit_of(table: Table, name: str) -> str:
    """The unit of a column: what the file states, else what the heading or the label has; empty where none says."""
    return table.units.get(name) or unit_in(name) or unit_in(table.labels.get(name, ""))


TAILS = {
    "s",
    "ms",
    "us",
    "V",
    "mV",
    "A",
    "mA",
    "W",
    "mW",
    "m",
    "mm",
    "um",
    "degC",
    "degF",
    "deg",
    "rad",
    "N",
    "mN",
    "MPa",
    "Pa",
    "kPa",
    "ohm",
    "K",
    "g",
    "kg",
    "percent",
}
SLASHED = TAILS | {"°C", "C", "°", "%", "Ohm", "Ω", "min", "h", "kN", "GPa", "µm", "μm", "kW", "kV", "cm", "1", "-"}


def is_time(name: str) -> bool:
    """Whether a heading names a time."""
    said = words(name)
    return bool(said) and said[0] in TIMES


def time_column(table: Table) -> str:
    """The only column whose heading names a time. Raises MeasuredDataError where none or several do."""
    names = table.order or tuple(table.columns)
    result = [name for name in names if is_time(name)]
    if len(result) == 1:
        return result[0]
    reason = f"columns {listed(result)} may be the time" if result else "no column is named like a time"
    raise MeasuredDataError(f"{table.path}: {reason}; say which it is (it has: {listed(names)})")
