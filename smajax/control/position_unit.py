"""The unit in which set points and figures of merit of a load are given and shown: degrees of an angle, millimetres of a length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Array

from smajax.control.figures_of_merit import BAND_DEGREES, band_of
from smajax.control.load_equation import moving_load, stroke_of
from smajax.core.display_units import display
from smajax.model.system import System

SHARES = (
    0.15,
    0.3,
    0.45,
    0.6,
    0.75,
    0.9,
)  # of the stroke: set points of a load other than the arm, where none are given
SLACK = 0.2  # of the stroke, beyond which no set point of a load without stops makes sense


class PositionUnit(NamedTuple):
    """Of the position of a load."""

    shown: str  # deg, mm
    own: str  # rad, m
    command: str = "V"  # of what the drive is commanded

    @property
    def is_angle(self) -> bool:
        return self.shown == "deg"

    @property
    def symbol(self) -> str:
        """Behind a number: `°`, ` mm`."""
        return "°" if self.is_angle else f" {self.shown}"

    @property
    def label(self) -> str:
        """Of an axis: `°`, `mm`."""
        return self.symbol.strip()

    @property
    def axis(self) -> str:
        """Of the position over time."""
        return "arm angle (°)" if self.is_angle else f"position ({self.label})"

    @property
    def factor(self) -> float:
        """How many make one of the program's own."""
        return 180.0 / np.pi if self.is_angle else display(self.own).factor

    def to_own(self, values: object) -> np.ndarray:
        """Radians or metres, of any shape."""
        numbers = np.asarray(values, dtype=float)
        return np.radians(numbers) if self.is_angle else numbers / self.factor

    def of(self, values: object) -> np.ndarray:
        """Degrees or millimetres, of any shape."""
        numbers = np.asarray(values, dtype=float)
        return np.degrees(numbers) if self.is_angle else numbers * self.factor


DEGREES = PositionUnit("deg", "rad")


def unit_of(system: System) -> PositionUnit:
    """Of a load that moves. Raises ValueError of one that does not."""
    own = moving_load(system).reading[1]
    return PositionUnit(display(own).unit or own, own, system.drive.command[1])


def check_unit(system: System, given: PositionUnit) -> None:
    """ValueError where settings are in another unit than the plant's."""
    unit = unit_of(system)
    if given.shown != unit.shown:
        raise ValueError(
            f"set points and noise are in {given.shown}, and the position of the load {type(system.load).__name__} is shown in "
            f"{unit.shown}: give them in {unit.shown} and unit={unit.shown!r}."
        )
    if given.command != unit.command:
        raise ValueError(
            f"commands are in {given.command}, and the drive {type(system.drive).__name__} takes {unit.command}: give command={unit.command!r}."
        )


def unit_named(shown: str, command: str = "V") -> PositionUnit:
    """`deg` or `mm`; another one is that of a load of one's own."""
    return PositionUnit(shown, {"deg": "rad", "mm": "m"}.get(shown, shown), command)


def beyond_ends(values: Array | np.ndarray, ends: tuple[float, float], share: float) -> tuple[float, float] | None:
    """(least, most) of `values` that lie beyond the ends by more than that share of the way between them, which is nothing where an end is open; else None."""
    low, high = ends
    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    room = share * (high - low) if np.isfinite(high - low) else 0.0
    return (least, most) if least < low - room or most > high + room else None


def position_range(system: System) -> tuple[float, float]:
    """Between which set points make sense, in the unit shown: the stops, and where there are none the stroke and a fifth more."""
    load, unit = moving_load(system), unit_of(system)
    start, stroke = float(load.start()), float(stroke_of(system))
    low, high = (float(end) for end in load.limits())
    low = low if np.isfinite(low) else start - SLACK * stroke
    high = high if np.isfinite(high) else start + (1.0 + SLACK) * stroke
    return float(unit.of(low)), float(unit.of(high))


def default_set_points(system: System, count: int = len(SHARES)) -> tuple[float, ...]:
    """Of a load, evenly over its stroke, in the unit shown, to three digits."""
    load, unit = moving_load(system), unit_of(system)
    shares = np.linspace(SHARES[0], SHARES[-1], count)
    positions = unit.of(float(load.start()) + shares * float(stroke_of(system)))
    return tuple(float(f"{one:.3g}") for one in positions)


def band_shown(system: System) -> float:
    """How near counts as there, in the unit shown: a degree, or a hundredth of the stroke."""
    unit = unit_of(system)
    return BAND_DEGREES if unit.is_angle else float(f"{float(unit.of(band_of(system))):.3g}")
