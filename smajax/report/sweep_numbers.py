"""Numbers that the pictures of a sweep draw, as `sweep.json` holds them, and a digest of them that each picture carries.

A map has, for each figure of merit, the median and the worst over the set points that the plant can reach, at the nominal gain.
"""

from __future__ import annotations

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from smajax.control.figures_of_merit import Merit
from smajax.control.position_unit import DEGREES, PositionUnit
from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep

# Figure of merit -> (label, unit shown, factor from SI); of an angle.
SHOWN = {
    "reach_time": ("reach time", "s", 1.0),
    "settling_time": ("settling time", "s", 1.0),
    "overshoot": ("overshoot", "°", 180.0 / np.pi),
    "steady_error": ("steady error", "°", 180.0 / np.pi),
    "energy": ("energy into the wire", "J", 1.0),
    "switches_per_second": ("switches a second", "1/s", 1.0),
    "peak_temperature": ("peak temperature", "°C", 1.0),
}
MAPPED = ("settling_time", "overshoot", "steady_error", "energy")
SUMMARIES: Mapping[str, Callable[..., np.ndarray]] = {"median": np.nanmedian, "worst": np.nanmax}
# Figure of merit -> (the one that decides whether it exists, what its absence means).
GREY = {"settling_time": ("settling_time", "never settles"), "overshoot": ("reach_time", "never arrives")}
DIGITS = 4
IN_PICTURE = "numbers"  # keyword of the text in a picture that holds the digest


def shown_in(unit: PositionUnit) -> dict[str, tuple[str, str, float]]:
    """`SHOWN` of a load whose position is shown in this unit."""
    own = {name: (label, unit.label, unit.factor) for name, (label, symbol, _) in SHOWN.items() if symbol == "°"}
    return SHOWN if unit.is_angle else {**SHOWN, **own}


def merit_values(one: Merit, name: str, unit: PositionUnit = DEGREES) -> np.ndarray:
    """A figure of merit in the unit shown."""
    return np.asarray(getattr(one, name)) * shown_in(unit)[name][2]


def nominal_gain(grid: Grid) -> int:
    """The index of the ratio of the main gain that is nearest to 1."""
    return int(np.argmin(np.abs(grid.gains - 1.0)))


def over_set_points(grid: Grid, sweep: ControllerSweep, name: str, of: Callable[..., np.ndarray]) -> np.ndarray:
    """A figure of merit at the nominal gain over the set points that the plant can reach, (A, A or 1), in the unit shown; of: such as `np.nanmedian`.

    NaN where none is in reach, and where the same of the deciding figure is infinite: the angle never arrives, or never settles.
    """
    beyond, at = np.isinf(sweep.least.grid), nominal_gain(grid)

    def summary(figure: str) -> np.ndarray:
        values = np.where(beyond, np.nan, merit_values(sweep.merits, figure, grid.plants.unit)[..., at])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of no set point in reach
            return np.asarray(of(values, axis=2))

    deciding, _ = GREY.get(name, (name, ""))
    return np.where(np.isfinite(summary(deciding)), summary(name), np.nan)


def map_numbers(grid: Grid, sweep: ControllerSweep) -> dict[str, dict[str, list[Any]]]:
    """Figure of merit -> median and worst over the set points in reach, a list a ratio of the first mismatch; units shown, null for none."""
    return {
        name: {how: plain(over_set_points(grid, sweep, name, of)) for how, of in SUMMARIES.items()} for name in MAPPED
    }


def plain(values: Any) -> Any:
    """A number, or nested lists of an array's, with `DIGITS` digits; None for what is no number."""
    if np.ndim(values):
        return [plain(one) for one in values]
    value = float(values)
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def digest_of(numbers: Any) -> str:
    """Of numbers in lists and dictionaries, by `DIGITS` digits: the same before they were written to a file and after."""

    def rounded(one: Any) -> Any:
        if isinstance(one, Mapping):
            return {name: rounded(value) for name, value in one.items()}
        if isinstance(one, str) or one is None:
            return one
        return plain(np.asarray(one)) if np.ndim(one) == 0 else [rounded(value) for value in one]

    return hashlib.sha256(json.dumps(rounded(numbers), sort_keys=True).encode()).hexdigest()


def comparison_digest(record: Mapping[str, Any]) -> str:
    """Of what the comparison draws, from the record of a sweep."""
    least = {name: one["all_controllers"] for name, one in record["least_times"].items()}
    return digest_of({"controllers": record["controllers"], "least_times": least})


def lines_digest(sweep: ControllerSweep) -> str:
    """Of the positions over time, which no record holds: by microradians, since the last digits differ between machines."""
    return digest_of({name: np.round(lines, 6).tolist() for name, lines in sweep.lines.items()})
