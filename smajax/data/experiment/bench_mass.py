"""The mass that a run holds, as text."""

from __future__ import annotations

from contextlib import suppress

from smajax.core.display_units import unit_meant
from smajax.core.units import parse_quantity
from smajax.data.experiment.toml_file import Quantity

USUAL = 1.0  # kg, of a weight on a bench: of a number without a unit kg or g is offered, whichever is nearer


def parse_mass(value: Quantity) -> float:
    """kg. Raises UnitError; of a number without a unit it offers the unit that makes it a weight on a bench."""
    meant: str | None = None
    with suppress(ValueError):
        meant = unit_meant(float(value), "kg", near=USUAL)
    return parse_quantity(value, "kg", offered=meant or "")
