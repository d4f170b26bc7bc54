"""Masses and stresses that the names of runs seem to say: to be suggested, never taken."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence

from smajax.model.load.base import GRAVITY

_HINT = re.compile(r"(?<![A-Za-z\d.,])(\d+(?:[.,]\d+)?)[ _-]?(g|kg|MPa|mpa|MPA)(?![A-Za-z])")


def hinted(run: str) -> tuple[float, str] | None:
    """(number, "g", "kg" or "MPa") of the first mass or stress in the name of a run; None where there is none."""
    found = _HINT.search(run)
    if found is None:
        return None
    unit = found.group(2)
    return float(found.group(1).replace(",", ".")), unit if unit in ("g", "kg") else "MPa"


def mass_hint(runs: Sequence[str], wire_diameter: float) -> str:
    """A message for runs whose names have a mass, or a stress in a wire of `wire_diameter` (m); else ""."""
    options, stresses = [], False
    for run in runs:
        found = hinted(run)
        if found is None:
            continue
        number, unit = found
        if unit == "MPa":
            stresses = True
            number, unit = 1e6 * number * 0.25 * math.pi * wire_diameter**2 / GRAVITY, "kg"
        options.append(f"--mass {shlex.quote(f'{run}={number:.4g} {unit}')}")
    if not options:
        return ""
    how = f"; MPa times the cross-section of a wire of {1e3 * wire_diameter:.4g} mm" if stresses else ""
    return (
        f"mass: names of runs have one, and nothing is taken from them: all runs get load_mass. If they say the hanging mass{how}, "
        f"draft again with {' '.join(options)} --overwrite"
    )
