"""What the columns of a log may be: quantity, unit and how sure, from headings and magnitudes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from smajax.core.units import UnitError, convert
from smajax.data.readers.headers import is_time, unit_of, words
from smajax.data.readers.table import Array, MeasuredDataError, Table, check_time

SURE, LIKELY, GUESS = "sure", "likely", "a guess"  # heading and unit; heading, unit by magnitude; neither
TIME = "time"
# Quantity -> (words of headings, the program's own unit). In this order: "ambient temperature" is not "temperature".
QUANTITIES: Mapping[str, tuple[frozenset[str], str]] = MappingProxyType(
    {
        "ambient_temperature": (frozenset(["ambient", "amb", "room", "air", "environment", "tamb", "tinf"]), "degC"),
        "voltage": (
            frozenset(["voltage", "volt", "volts", "u", "v", "spannung", "vin", "ucmd", "vcmd", "tension"]),
            "V",
        ),
        "current": (frozenset(["current", "amp", "amps", "ampere", "i", "strom", "courant"]), "A"),
        "power": (frozenset(["power", "watt", "watts", "p", "leistung"]), "W"),
        "duty": (frozenset(["duty", "pwm", "dutycycle"]), "1"),
        "stress": (frozenset(["stress", "sigma", "spannungmpa"]), "Pa"),
        "strain": (frozenset(["strain", "eps", "epsilon", "dehnung"]), "1"),
        "angle": (frozenset(["angle", "theta", "phi", "winkel", "encoder", "rotation"]), "rad"),
        "temperature": (frozenset(["temperature", "temp", "thermocouple", "twire", "tc", "temperatur", "t"]), "degC"),
        "position": (
            frozenset(["position", "pos", "displacement", "disp", "displ", "stroke", "lvdt", "laser", "weg", "x"]),
            "m",
        ),
        "resistance": (frozenset(["resistance", "res", "ohm", "r", "widerstand"]), "ohm"),
        "force": (frozenset(["force", "load", "loadcell", "kraft", "f"]), "N"),
        "mass": (frozenset(["mass", "payload", "weight", "masse"]), "kg"),
    }
)
# Units that people write and that mean something else to a unit library.
MEANT = {"C": "degC", "°": "deg", "F": "degF", "": "", "-": "1", "%": "percent", "Ohm": "ohm", "Ω": "ohm"}
DRIVES, COUPON = (
    ("voltage", "current", "power", "duty"),
    ("temperature", "stress"),
)  # inputs of a heated wire, of a coupon


@dataclass(frozen=True)
class Column:
    """A column and what it may be; `quantity` is empty where nothing tells."""

    key: str | int  # as an experiment file names it
    name: str
    quantity: str
    unit: str
    sure: str
    why: str


def _unit_by_size(quantity: str, values: Array) -> str:
    """The unit in which numbers of this size are usual for a wire."""
    values = values[np.isfinite(values)]
    size = float(np.max(np.abs(values))) if values.size else 0.0
    match quantity:
        case "voltage":
            return "mV" if size > 300.0 else "V"
        case "current":
            return "mA" if size > 50.0 else "A"
        case "power":
            return "mW" if size > 2000.0 else "W"
        case "duty":
            return "percent" if size > 1.5 else "1"
        case "strain":
            return "percent" if size > 0.3 else "1"
        case "stress":
            return "Pa" if size > 1e5 else "MPa"
        case "angle":
            return "deg" if size > 7.0 else "rad"
        case "temperature" | "ambient_temperature":
            return "K" if values.size and float(np.min(values)) > 200.0 else "degC"
        case "position":
            return "mm" if size > 0.3 else "m"
        case "mass":
            return "g" if size > 5.0 else "kg"
        case "force":
            return "N"
    return QUANTITIES[quantity][1] if quantity in QUANTITIES else "s"


def time_unit(seconds: Array) -> str:
    """Of a clock without a unit: milliseconds where it counts in whole numbers beyond an hour."""
    whole = bool(np.all(seconds == np.round(seconds)))
    return "ms" if whole and float(np.ptp(seconds)) > 3600.0 and float(np.median(np.diff(seconds))) >= 2.0 else "s"


def _of_kind(unit: str, own: str) -> bool:
    try:
        convert(0.0, unit, own)
    except UnitError:
        return False
    return True


def _by_unit(unit: str) -> str:
    """The quantity that a unit alone speaks for."""
    order = ("voltage", "current", "power", "temperature", "position", "stress", "force", "resistance", "mass", "angle")
    return next((name for name in order if _of_kind(unit, QUANTITIES[name][1])), "")


def _by_words(heading: str, unit: str) -> str:
    """The quantity that the words of a heading or a label name and that may have this unit, if there is one."""
    said = set(words(heading))
    return next(
        (one for one, (known, own) in QUANTITIES.items() if said & known and (not unit or _of_kind(unit, own))), ""
    )


def _unit(table: Table, name: str) -> str:
    """The column's unit as the unit library has it; empty where neither file nor heading says."""
    said = unit_of(table, name)
    return "degF" if not said and _in_fahrenheit(table, name) else MEANT.get(said, said)


def _in_fahrenheit(table: Table, name: str) -> bool:
    """Whether a temperature ends with `_F`, and no other column has another letter there, as thermocouples do."""
    stem, _, letter = name.rpartition("_")
    if letter not in ("F", "f") or _by_words(stem, "") not in ("temperature", "ambient_temperature") or stem == "t":
        return False
    return not any(
        other.rpartition("_")[0] == stem and len(other) == len(name) for other in table.columns if other != name
    )


def _column(table: Table, key: str | int, name: str) -> Column:
    values = table.columns[name]
    unit = _unit(table, name)
    if isinstance(key, int):
        return Column(key, name, "", "", GUESS, "no heading")
    label = table.labels.get(name, "")
    quantity, where = _by_words(name, unit), "heading"
    if not quantity and label:
        quantity, where = _by_words(label, unit), f"its label {label!r}"
    if quantity and unit:
        return Column(key, name, quantity, unit, SURE, f"{where} and unit")
    if quantity:
        return Column(key, name, quantity, _unit_by_size(quantity, values), LIKELY, f"{where}; unit by magnitude")
    if unit and unit != "1" and (quantity := _by_unit(unit)):
        return Column(key, name, quantity, unit, LIKELY, "unit in the heading")
    named = _by_words(name, "") or _by_words(label, "")
    if is_time(name):
        why = "named like a time, and goes back somewhere"
    elif unit and named:
        own = QUANTITIES[named][1]
        why = f"named like a {named}, and its unit {unit!r} is none of that: expected one like {own!r}"
    else:
        why = "nothing tells"
    return Column(key, name, "", unit, GUESS, why)


def _is_clock(table: Table, name: str, headed: bool) -> bool:
    values = table.columns[name]
    grows = (
        values.size > 1
        and bool(np.isfinite(values).all() and np.all(np.diff(values) >= 0.0))
        and float(values[-1]) > float(values[0])
    )
    unit = _unit(table, name)
    if name in table.moments:
        return grows
    if headed:
        return is_time(name) and grows and (not unit or _of_kind(unit, "s"))
    return grows and bool(np.all(np.diff(values) > 0.0))


def in_levels(values: Array) -> bool:
    """Whether a signal rests at a few levels, as a command does and a sensor does not."""
    return np.unique(values).size <= max(2, values.size // 20)


def _by_shape(columns: Sequence[Column], table: Table) -> list[Column]:
    """Columns without headings: what rests at levels is taken for the voltage, what moves for the position."""
    result: list[Column] = []
    for one in columns:
        taken = {other.quantity for other in result} | {other.quantity for other in columns if other.quantity}
        quantity = "voltage" if in_levels(table.columns[one.name]) else "position"
        if one.quantity or not isinstance(one.key, int) or quantity in taken:
            result.append(one)
            continue
        unit = _unit_by_size(quantity, table.columns[one.name])
        why = "it rests at levels" if quantity == "voltage" else "it moves all the time"
        result.append(Column(one.key, one.name, quantity, unit, GUESS, f"no heading; {why}; unit by magnitude"))
    return result


def time_unit_of(table: Table, name: str) -> str:
    """Of a column that is no clock, as its heading has it."""
    unit = _unit(table, name)
    return unit if unit and name not in table.moments and _of_kind(unit, "s") else "s"


def times_not_read(table: Table) -> dict[str, str]:
    """Columns that are named like a time, or hold clock times, and that are no clock: each with why, in words."""
    wrong = {}
    for name in table.order or (*table.columns, *table.unusable):
        unit = _unit(table, name)
        if name in table.clocks or not (is_time(name) or name in table.moments) or (unit and not _of_kind(unit, "s")):
            continue
        if name in table.unusable:
            wrong[name] = table.unusable[name].split("; expected")[0]
        elif not _is_clock(table, name, True) and not _column(table, name, name).quantity:
            try:
                check_time(table.columns[name], f"column {name!r}", unit or "s", table.place)
            except MeasuredDataError as error:
                wrong[name] = str(error).split("; sort")[0]
    return wrong


def columns_of(table: Table) -> list[Column]:
    """Every usable column with what it may be, the time first where there is one; each quantity once, by the surest."""
    every = table.order or tuple(table.columns)
    order = [name for name in every if name in table.columns]
    headed = not all(name.isdigit() for name in every)
    clocks = [name for name in order if _is_clock(table, name, headed)]
    # Before one that may be a temperature, `T_1`, one that has a moment or a unit of time.
    clocks.sort(key=lambda name: (name not in table.moments, not _unit(table, name)))
    clock = None if table.clocks else next(iter(clocks), None)
    result: list[Column] = []
    if clock is not None:
        unit = _unit(table, clock)
        key: str | int = clock if headed else every.index(clock) + 1
        sure, why = (
            (SURE, "clock times, read as seconds from the first one")
            if clock in table.moments
            else (SURE, "heading and unit")
            if headed and unit
            else (LIKELY if headed else GUESS, "it only grows; unit by magnitude")
        )
        result.append(Column(key, clock, TIME, unit or time_unit(table.columns[clock]), sure, why))
    rest = [_column(table, name if headed else every.index(name) + 1, name) for name in order if name != clock]
    rest = _by_shape(rest, table)
    rank = {SURE: 0, LIKELY: 1, GUESS: 2}
    for one in rest:
        rivals = [other for other in rest if other.quantity == one.quantity]
        first = min(rivals, key=lambda other: rank[other.sure])
        if one.quantity and one is not first:
            one = Column(one.key, one.name, "", one.unit, GUESS, f"{first.name!r} is taken for the {first.quantity}")
        result.append(one)
    return result
