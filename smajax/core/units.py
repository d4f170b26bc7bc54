"""Physical units: the only file that knows units other than the program's own.

Everywhere else numbers are SI, temperatures are degrees Celsius and angles are radians. Text such as
`"24.2 J/g"` is turned into such a number here, once, when a file is read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBER = re.compile(r"^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$")
_DIMENSIONLESS = {"", "1", "-"}
LONGEST = 64  # characters of a unit
# A power that is no small number: the unit library works out "m**9**9**9" before it says that this is no unit.
_TOWER = re.compile(
    r"(?:\*\*|\^)(?!\s*\(?\s*[+-]?\d{1,2}(?:[./]\d{1,2})?\s*\)?(?![\d.eE(]|\s*(?:\*\*|\^)))|[\d⁰¹²³⁴⁵⁶⁷⁸⁹]\s*[⁰¹²³⁴⁵⁶⁷⁸⁹]"
)
# Spellings that people write and the unit library does not know, or knows as something else.
_SPELLINGS = (("°C", "degC"), ("ºC", "degC"), ("℃", "degC"), ("°F", "degF"), ("°", "deg"), ("Ohm", "ohm"), ("·", "*"))
# Units that people write out, to their symbols; with them goes any prefix.
_SYMBOLS: Mapping[str, str] = MappingProxyType(
    {
        "volt": "V",
        "ampere": "A",
        "amp": "A",
        "watt": "W",
        "second": "s",
        "sec": "s",
        "newton": "N",
        "pascal": "Pa",
        "meter": "m",
        "metre": "m",
        "gram": "g",
        "joule": "J",
        "ohm": "ohm",
        "kelvin": "K",
        "celsius": "degC",
        "fahrenheit": "degF",
    }
)
# Units of measured channels, for text that differs from one of them by its case alone.
_USUAL = "V mV A mA W mW s ms m mm um g kg N mN Pa kPa MPa GPa K degC degF deg rad ohm J kJ Hz"


class UnitError(ValueError):
    """A quantity whose unit is missing, not known, or of another kind than the one expected."""


@lru_cache(maxsize=1)
def _registry() -> Any:
    """The unit registry, created at first use because reading its definitions takes a noticeable time."""
    import pint

    return pint.UnitRegistry(cache_folder=None)


def _meant(text: str) -> str | None:
    """The unit that people mean by text such as "mVolt" or "MM", which the unit library does not know; or None."""
    name = text.strip()
    named = re.fullmatch(rf"([numkMG\u00b5]?)((?i:{'|'.join(_SYMBOLS)}))(?i:s|es)?", name)
    if named is not None:
        return named.group(1) + _SYMBOLS[named.group(2).lower()]
    return next((unit for unit in _USUAL.split() if unit.lower() == name.lower()), None)


@lru_cache(maxsize=512)
def _unit(text: str, like: str | None = None) -> Any:
    """The unit that `text` names; raises UnitError when there is none such. like: what was expected, if that is known."""
    name = text.strip()
    if name in _DIMENSIONLESS:
        return _registry().parse_units("dimensionless")
    for result, meant in _SPELLINGS:
        name = name.replace(result, meant)
    try:
        if len(name) > LONGEST or _TOWER.search(name):
            raise ValueError("no power of a unit")
        # Inside a compound unit ("J/(kg degC)") a degree is a difference: pint's as_delta.
        return _registry().parse_units(name, as_delta=True)
    except (MemoryError, ImportError):  # a unit library that lacks a package of its own says so itself
        raise
    except Exception as error:  # besides its own errors the unit library lets those of Python's tokenizer through
        guess = _meant(text)
        if guess is not None:
            advice = f"did you mean {guess!r}?"
        elif like is not None and like not in _DIMENSIONLESS:
            advice = f"expected one like {like!r}"
        else:
            advice = "write it like 'J/(kg K)', 'W/m^2/K', 'MPa/K', 'degC'"
        raise UnitError(f"unit {text[:LONGEST]!r} is not known; {advice}") from error


def is_unit(text: str) -> bool:
    """Whether `text` names a unit, or none ("-", "1", "%")."""
    try:
        _unit(text)
    except UnitError:
        return text.strip() == "%"
    return True


def _is_absolute(unit: Any) -> bool:
    """Whether the unit is one of absolute temperature on a scale with an offset (degC, degF)."""
    return str(unit) in ("degree_Celsius", "degree_Fahrenheit")


def _is_temperature(unit: Any) -> bool:
    return bool(unit.dimensionality == _registry().kelvin.dimensionality)


def _difference(unit: Any) -> Any:
    """The unit of a difference of two values in `unit` (delta_degC for degC, the unit itself otherwise)."""
    return _registry().parse_units(f"delta_{unit}") if _is_absolute(unit) else unit


def _plain(unit: Any) -> str:
    return "1 (no unit)" if str(unit) == "dimensionless" else f"{unit:~C}".replace("**", "^")


def _hint(got: str, expected: str) -> str:
    if got.strip() == "m" and expected == "s":
        return " (minutes are 'min')"
    words = re.findall(r"[A-Za-z]+", got)
    if "C" in words:
        return " ('C' is the coulomb; write degC)"
    if "F" in words:
        return " ('F' is the farad; write degF)"
    return ""


def _factor(got: str, expected: str, difference: bool) -> tuple[Any, Any]:
    """The two units, checked to be of one kind, ready for a conversion from the first to the second."""
    source, target = _unit(got, expected), _unit(expected)
    if source.dimensionality != target.dimensionality:
        raise UnitError(
            f"got unit {got!r}{_hint(got, expected)}, expected one like {expected!r}, to which it cannot be converted; change the unit or "
            "the quantity"
        )
    if _is_temperature(target):
        if difference or not _is_absolute(target):
            # The program's absolute temperatures are degC, so a kelvin asked for is always a difference.
            return _difference(source), _difference(target)
        if str(source).startswith("delta_"):
            raise UnitError(f"got a temperature difference ({got!r}), expected a temperature in {expected!r}")
    if not target.dimensionality:
        angle = _registry().radian
        root = _registry().get_root_units
        source_is_angle, target_is_angle = root(source)[1] == angle, root(target)[1] == angle
        if target_is_angle and not source_is_angle:
            raise UnitError(f"got {got or 'no unit'!r}, expected an angle; write it with 'deg' or 'rad'")
        if source_is_angle and not target_is_angle and str(target) == "dimensionless":
            raise UnitError(f"got an angle ({got!r}), expected a plain number or a percentage")
    return source, target


def convert(
    values: float | NDArray[np.float64], unit: str, expected: str, difference: bool = False
) -> NDArray[np.float64]:
    """Values of any shape measured in `unit`, given in `expected`; same shape.

    difference: the values are differences (a noise, a width), so degC to K adds nothing.
    Raises UnitError when the units are unknown or not of one kind.
    """
    source, target = _factor(unit, expected, difference)
    numbers = np.asarray(values, dtype=np.float64)
    return np.asarray(_registry().Quantity(numbers, source).to(target).magnitude, dtype=np.float64)


def parse_quantity(
    value: str | float, expected: str, difference: bool = False, bare: str = "", offered: str = "", also: str = ""
) -> float:
    """The number that a quantity such as `"24.2 J/g"` is in the unit `expected` (`"J/kg"`: 24200.0).

    A bare number is in the unit `bare`; without one it is accepted only where the expected unit is "1": anything else
    must say its unit. offered: the unit that the message of one without puts behind it, in the place of `expected`.
    also: a unit of another kind that is read as well, of which the number is taken (`Parameter.also`).
    `expected` "degC" reads "341 K" as the absolute 67.85; `expected` "K" is always a difference.
    Raises UnitError naming what was got, what was expected and what to do.
    """
    if isinstance(value, str):
        match = _NUMBER.match(value)
        if match is None:
            like = (
                "a number like '1.5'"
                if expected in _DIMENSIONLESS
                else f"a number and a unit like '1.5 {_plain(_unit(expected))}'"
            )
            raise UnitError(f"got {value!r}, expected {like}")
        digits, unit = match.groups()
        number = float(digits)
        if re.match(r",\d", unit):
            raise UnitError(f"got {value!r}, expected a decimal point; write {value.replace(',', '.', 1)!r}")
    elif isinstance(value, bool):  # which is a number to Python
        raise UnitError(f"got {value}, expected a number{'' if expected in _DIMENSIONLESS else f' in {expected}'}")
    else:
        number, unit = float(value), ""
        digits = repr(number)
    if not math.isfinite(number):
        raise UnitError(f"got {value!r}, expected a finite number in {expected!r}")
    if unit in _DIMENSIONLESS and bare:
        unit = bare
    if unit in _DIMENSIONLESS and expected not in _DIMENSIONLESS:
        like = offered or expected
        raise UnitError(f"got {value!r} without a unit, expected one like {like!r}; write '{number:g} {like}'")
    try:
        shift = _shift(unit, expected, difference)
    except UnitError as error:
        if not also:
            raise
        try:
            return parse_quantity(value, also, difference)
        except UnitError:
            raise error from None
    if shift is None or len(digits) > LONGEST:
        return float(convert(number, unit, expected, difference))
    # As if it were written in the unit expected: 0.31 mm is 0.00031 m, and not a bit beside it.
    mantissa, _, exponent = digits.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + shift}")


@lru_cache(maxsize=512)
def _shift(unit: str, expected: str, difference: bool) -> int | None:
    """By how many places the decimal point moves from `unit` to `expected`; None where the conversion is no power of ten."""
    zero, one = (float(convert(number, unit, expected, difference)) for number in (0.0, 1.0))
    if zero != 0.0:
        return None
    power = round(math.log10(one)) if one > 0.0 else 0
    return power if math.isclose(one, 10.0**power, rel_tol=1e-12) else None


def to_si(value: str | float, unit: str) -> float:
    """The value in the program's own units (SI, degC, rad).

    A number is taken to be in `unit`; text carries its own unit, which must be of the same kind as `unit`.
    `to_si(24.2, "J/g")` and `to_si("24.2 J/g", "J/kg")` are both 24200.0.
    Raises UnitError as `parse_quantity` does.
    """
    own = own_unit(unit)
    if isinstance(value, str):
        return parse_quantity(value, own)
    return float(convert(value, unit, own))


def own_unit(unit: str) -> str:
    """The program's own unit for what `unit` measures: "K" and "degF" -> "degC", "deg" -> "rad", else SI base."""
    result = _unit(unit)
    if _is_temperature(result) and not str(result).startswith("delta_"):
        return "degC"
    return _compact(_registry().get_root_units(result)[1])


def _compact(unit: Any) -> str:
    """Base units as text; grams, which the library takes as its root, become kilograms."""
    text = "1" if str(unit) == "dimensionless" else f"{unit:C}".replace("**", "^")
    return re.sub(r"\bgram\b", "kilogram", text)
