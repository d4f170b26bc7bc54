"""How numbers look at the edge: millimetres, degrees, per cent and megapascals instead of the program's SI."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from smajax.core.names_of_runs import parameter_of

Value = TypeVar("Value", float, np.ndarray)


@dataclass(frozen=True)
class Display:
    """The unit that a reader sees, and how many of it make one of the program's own."""

    unit: str
    factor: float

    def of(self, value: Value) -> Value:
        """`value` (SI, degrees Celsius, radians; any shape) in the unit shown, which differs by a factor only."""
        return value * self.factor

    def with_unit(self, value: float, count: int = 4) -> str:
        """`12.3 mm` of 0.0123 m: `digits` of it and the unit, if there is one."""
        return f"{digits(self.of(value), count)} {self.unit}".rstrip()


_SHOWN = {
    "m": Display("mm", 1e3),
    "rad": Display("deg", math.degrees(1.0)),
    "Pa": Display("MPa", 1e-6),
    "Pa/K": Display("MPa/K", 1e-6),
    "degC": Display("°C", 1.0),
    "ohm m": Display("µΩ m", 1e6),
    "J/kg": Display("J/g", 1e-3),
    "kg": Display("g", 1e3),
    "-": Display("", 1.0),
    "1": Display("", 1.0),
    "": Display("", 1.0),
}
# Of a file: the unit, how many of it make one of the program's own, and the size of a value in that from which and below which it is used.
_WRITTEN = {
    "m": (("mm", 1e3, 0.0, 0.1),),
    "m/s": (("mm/s", 1e3, 0.0, 0.1),),
    "m/N": (("mm/N", 1e3, 0.0, 0.1),),
    "rad": (("deg", math.degrees(1.0), 0.0, math.inf),),
    "Pa": (("MPa", 1e-6, 1e4, 1e9), ("GPa", 1e-9, 1e9, math.inf)),
    "Pa/K": (("MPa/K", 1e-6, 1e4, math.inf),),
    "ohm m": (("µΩ m", 1e6, 0.0, 1e-3),),
    "J/kg": (("J/g", 1e-3, 1e3, math.inf),),
    "kg": (("g", 1e3, 0.0, 0.1),),
}
LARGE = 1e6  # from here on numbers are written with a power of ten
_PERCENT = Display("%", 100.0)


def display(unit: str, quantity: str = "") -> Display:
    """How to show a value given in `unit`; a unit that has no entry is shown as it is.

    A strain is the one plain number that is read in per cent: `quantity`, its name, distinguishes it from the others. A run's own
    parameter is named `recoverable_strain[run]`.
    """
    if unit in ("-", "1", "") and parameter_of(quantity).endswith("strain"):
        return _PERCENT
    return _SHOWN.get(unit) or Display(unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴"), 1.0)


def written(unit: str, value: float) -> Display:
    """The unit in which an engineer would write a `value` given in `unit`: 75 GPa, and 0.31 mm beside 0.5 m."""
    fitting = (
        Display(name, factor)
        for name, factor, low, high in _WRITTEN.get(unit, ())
        if low <= abs(value) < high and value
    )
    return next(fitting, Display(unit, 1.0))


def unit_meant(
    number: float, unit: str, low: float = -math.inf, high: float = math.inf, near: float | None = None
) -> str | None:
    """The unit in which a bare number may have been meant, of a value given in `unit` that lies within low and high; None: none does.

    `unit` itself or one that an engineer writes it in; of several the one whose value is nearest, in proportion, to `near`: 400 of a wire of
    0.5 m are mm.
    """
    factors = {unit: 1.0, **{name: factor for name, factor, *_ in _WRITTEN.get(unit, ())}}
    fitting = [name for name, factor in factors.items() if low <= number / factor <= high]
    if not fitting or not near or not number / near > 0.0:
        return fitting[0] if fitting else None
    return min(fitting, key=lambda name: abs(math.log(number / factors[name] / near)))


def digits(value: float | None, count: int = 4, zeros: bool = False) -> str:
    """`value` with `count` significant digits, trailing zeros kept if `zeros`; a dash where there is no number."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:{'#' if zeros else ''}.{count}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa.rstrip('.')}e{int(exponent)}"
    return text.rstrip(".")


def chance(value: float | None) -> str:
    """A p-value with two digits; one too small for a float is not zero."""
    return "< 1e-300" if value is not None and 0.0 <= value < 1e-300 else digits(value, 2)


def _exponent(value: float) -> int:
    """Power of ten of `value` as two significant digits show it."""
    return int(f"{value:.1e}".split("e")[1])


def with_error(value: float, error: float | None) -> str:
    """`24.19 ± 0.21`, `860 ± 110`: the error with two significant digits, the value to the same place.

    Without an error, the value.
    """
    if error is None or not math.isfinite(error) or not math.isfinite(value) or error <= 0.0:
        return digits(value)
    decimals = 1 - _exponent(error)
    if decimals <= 6 and max(abs(value), error) < LARGE:
        places = max(decimals, 0)
        return f"{round(value, decimals):.{places}f} ± {round(error, decimals):.{places}f}"
    # As many digits as reach the error's second one, and no more than a reader takes in.
    count = min(max(2 + _exponent(value or error) - _exponent(error), 2), 8)
    return f"{digits(value, count, zeros=True)} ± {digits(error, 2, zeros=True)}"


def correlation(value: float | None) -> str:
    """Two decimals; one that rounds to nothing is 0, and none is a dash."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.2f}" if abs(value) >= 0.005 else "0"


def p_value(value: float | None) -> str:
    """`p = 0.41`, `p < 1e-300`."""
    text = chance(value)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def label(name: str) -> str:
    """A name as words: `sensor_lag.time_constant` -> `sensor lag: time constant`."""
    return name.replace(".", ": ").replace("_", " ")


def axis_label(name: str, shown: Display) -> str:
    """`position (mm)`, or the name alone for a plain number."""
    return f"{label(name)} ({shown.unit})" if shown.unit else label(name)
