"""Plants that differ in several mismatches at once, for a sweep over more of them than a map has axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.control.mismatch import check_known, mismatches_of, short_name
from smajax.control.sweep.grid import LEAST, MOST, check_mismatches, check_ratios, ratios_at
from smajax.core.parameters import get_parameters
from smajax.core.sobol import sobol_points
from smajax.model.system import System

SPREAD = 64  # plants, where nobody says how many


def spread_plants(
    system: System, mismatches: Sequence[str], count: int = SPREAD, least: float = LEAST, most: float = MOST
) -> dict[str, np.ndarray]:
    """Parameter -> its value in each plant, (count,), SI: a batch for `sweep_controllers`.

    Each parameter is `least` to `most` times the value that the controller assumes, evenly by logarithm to either side of 1 as the
    ratios of a map, all at once at Sobol points, whatever the order of the names; fewer plants are the first of more. Raises ValueError
    for an unknown mismatch, the same twice, one that is zero where the controller assumes it, no plant, and ratios that do not go from below
    1 to above 1.
    """
    if isinstance(mismatches, str):
        raise ValueError(f"got {mismatches!r}, expected several names such as ('inertia', 'damping', 'convection').")
    asked = [short_name(name) for name in mismatches]
    check_known(asked, system)
    table = mismatches_of(system, asked)
    check_mismatches(asked, tuple(table))
    check_ratios(least, most)
    if count < 1 or int(count) != count:
        raise ValueError(f"got {count} plants, expected a whole number of at least one.")
    ordered = [name for name in table if name in asked]
    names = [table[name] for name in ordered]
    assumed = np.asarray(get_parameters(system, names), dtype=float)
    for mismatch, name, value in zip(ordered, names, assumed, strict=True):
        if value == 0.0:
            raise ValueError(
                f"{mismatch} ({name}) is 0 where the controller assumes it, so that no ratio changes it: leave it out, or give it a value."
            )
    points = sobol_points(int(count), len(names), seed=0)
    return dict(zip(names, (assumed * ratios_at(2.0 * points - 1.0, least, most)).T, strict=True))
