"""How wrong a plant may be: names and sizes, the same for `simulate --mismatch`, `sweep --over` and `tune --variation`.

`+20%` and `-50%` are changes of what is believed, upwards or downwards; `20%` (and `0.2`) of a variation is both ways.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from smajax.core.names import close_matches
from smajax.core.parameters import check_bounds, parameter_values, parameters, set_parameters
from smajax.core.units import UnitError, parse_quantity
from smajax.model.load.arm import Arm
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System

# What is looked at by sweeps and tuning: its name on the command line -> the plant's parameter.
MISMATCHES = {
    "inertia": "inertia_ratio",
    "damping": "damping",
    "convection": "convection_coefficient",
    "ambient": "ambient_temperature",
    "payload": "payload_mass",
    "supply": "amplifier_gain",
}
# The same of other loads and drives, and of a user's own: what their parameters are called.
_OTHER = {"inertia": ("slider_mass",), "payload": ("load_mass",), "supply": ("supply_voltage",)}
_OF_START = ("start_fraction", "start_temperature", "start_angle")
MINUS, BOTH = "\N{MINUS SIGN}", "\N{PLUS-MINUS SIGN}"
_SIZE = r"\s*(\d+\.?\d*|\.\d+)\s*%\s*"
_ONE_WAY = re.compile(rf"\s*([-+{MINUS}]){_SIZE}")
_BOTH_WAYS = re.compile(rf"\s*(?:{BOTH}|\+\s*/?\s*[-{MINUS}]){_SIZE}")
_UNSIGNED = re.compile(_SIZE)


def mismatches_of(system: System, asked: Sequence[str] = ()) -> dict[str, str]:
    """`MISMATCHES` of a plant: of the arm those; of another one those that it has, then its load's other parameters by their names.

    asked: names of other parameters, of which those that a ratio changes (`of_a_ratio`) are added.
    """
    there = parameters(system)
    result: dict[str, str] = {}
    for short, own in MISMATCHES.items():
        found = next((name for name in (own, *_OTHER.get(short, ())) if name in there), "")
        if found:
            result[short] = found
    if not isinstance(system.load, Arm):
        result |= {name: name for name in parameters(system.load) if name not in result.values()}
    more = of_a_ratio(system) if asked else ()
    return result | {name: name for name in asked if name in more and name not in {*result, *result.values()}}


def of_a_ratio(system: System) -> tuple[str, ...]:
    """Parameters of a plant that a ratio changes: none that is zero, a temperature (of which a share tells nothing), or the state at the start."""
    table = parameters(system)
    return tuple(
        name
        for name, value in parameter_values(system).items()
        if value != 0.0 and table[name].unit != "degC" and name not in _OF_START
    )


def check_known(names: Sequence[str], system: System, what: str = "mismatch") -> None:
    """Raise ValueError for a name that is neither of `mismatches_of` nor of `of_a_ratio`; `what` the names are of."""
    own = mismatches_of(system)
    known = [*own, *(name for name in of_a_ratio(system) if name not in own.values())]
    for name in names:
        if name in known:
            continue
        if name in parameters(system):
            zero = parameter_values(system)[name] == 0.0
            raise ValueError(
                f"`{name}` is {'0' if zero else 'a temperature, or of the start'}: a ratio of it changes nothing, or tells nothing. Give values in a batch "
                "of plants: `plants=` in Python."
            )
        raise ValueError(f"no {what} `{name}`{close_matches(name, known, 'there are')}.")


def check_ratios_of(system: System, ratios: Mapping[str, tuple[float, float]], table: Mapping[str, str]) -> None:
    """Raise ValueError where a plant at the least or the largest ratio of a mismatch has a value out of its bounds, or a start beyond the stops.

    ratios: by mismatch; table: mismatch -> parameter.
    """
    for mismatch, ends in ratios.items():
        name = table[mismatch]
        value = parameter_values(system)[name]
        for ratio in ends:
            plant = set_parameters(system, {name: ratio * value})
            try:
                check_bounds(plant)
            except ValueError as error:
                raise ValueError(f"{ratio:g} times {name}: {error}") from None
            load = plant.load
            if isinstance(load, AbstractMovingLoad):
                low, high = map(float, load.limits())
                if not low <= float(load.start()) <= high:
                    raise ValueError(
                        f"{ratio:g} times {name}: the load starts at {float(load.start()):.4g}, and its end stops are at {low:.4g} and {high:.4g} "
                        f"{load.reading[1]}. Give a smaller range."
                    )


def default_mismatches(system: System) -> tuple[str, str]:
    """The two that a sweep varies where nobody says: convection, and damping or, of a load without, the air."""
    return "convection", "damping" if "damping" in mismatches_of(system) else "ambient"


def short_name(name: str) -> str:
    """`convection` of `convection_coefficient`; any other name as it is."""
    names = {own: short for short, several in _OTHER.items() for own in several}
    return next((short for short, own in MISMATCHES.items() if own == name), names.get(name, name))


def ratio_of(name: str, text: str, plain: bool = False) -> float | None:
    """1.2 of `+20%`, 0.5 of `-50%`; None of text that is a value.

    plain: a percentage without a sign is a value too, of a parameter that has no unit.
    Raises ValueError for a percentage that does not say which way.
    """
    result = _ONE_WAY.fullmatch(text)
    if result is not None:
        size = float(result[2]) / 100.0
        return 1.0 + size if result[1] == "+" else 1.0 - size
    both = _BOTH_WAYS.fullmatch(text) or (None if plain else _UNSIGNED.fullmatch(text))
    if both is not None:
        raise ValueError(
            f"got {name}={text.strip()}, expected +{both[1]}% or -{both[1]}%, a change of what it is, or a value"
        )
    return None


def variation_of(widths: Mapping[str, str]) -> dict[str, float]:
    """Shares by the names of `MISMATCHES`, of text such as `20%`, `0.2` or `±20%`: 0.2.

    Raises ValueError for what is no share, one way alone, or twice of one parameter.
    """
    result: dict[str, float] = {}
    for name, text in widths.items():
        both = _BOTH_WAYS.fullmatch(text) or _UNSIGNED.fullmatch(text)
        if _ONE_WAY.fullmatch(text):
            size = text.strip().lstrip(f"+-{MINUS} ")
            raise ValueError(
                f"got {name}={text.strip()}, expected a variation, which goes both ways: {name}={size} is from -{size} to "
                f"+{size} of what the controller believes."
            )
        if short_name(name) in result:
            raise ValueError(f"{name} is `{short_name(name)}`, which is given already: give it once.")
        try:
            result[short_name(name)] = float(both[1]) / 100.0 if both else parse_quantity(text, "1")
        except UnitError as error:
            comma = f" ({error})" if re.fullmatch(r"\s*\d*,\d+\s*%?\s*", text) else ""
            raise ValueError(
                f"got {name}={text}, expected a share such as {name}=20% or {name}=0.2, with a comma before the next name{comma}."
            ) from None
    return result


def in_words(believed: float | None, true: float, unit: str) -> str:
    """`1.2 times (+20 %)`; `+4 K` of a temperature, of which a share tells nothing; "" where nothing is believed, or zero."""
    if believed is not None and unit == "degC":
        return f"{true - believed:+.4g} K"
    return f"{true / believed:.4g} times ({100.0 * (true / believed - 1.0):+.4g} %)" if believed else ""
