"""Plants that differ in several mismatches at once, for a sweep over more of them than a map has axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.stats

from smajax.control.mismatch import mismatches_of
from smajax.control.sweep.grid import LEAST, MOST, check_mismatches, ratios_at
from smajax.core.parameters import get_parameters
from smajax.model.system import System

SPREAD = 64  # plants, where nobody says how many


def spread_plants(
    system: System, mismatches: Sequence[str], count: int = SPREAD, least: float = LEAST, most: float = MOST
) -> dict[str, np.ndarray]:
    """Parameter -> its value in each plant, (count,), SI: a batch for `sweep_controllers`.

    Each parameter is `least` to `most` times the value that the controller assumes, evenly by logarithm to either side of 1 as the
    ratios of a map, all at once at Sobol points. Raises ValueError for an unknown mismatch, the same twice, one that is zero where
    the controller assumes it, and no plant.
    """
    table = mismatches_of(system)
    check_mismatches(mismatches, tuple(table))
    if count < 1:
        raise ValueError(f"got {count} plants, expected at least one.")
    names = [table[name] for name in mismatches]
    assumed = np.asarray(get_parameters(system, names), dtype=float)
    for mismatch, name, value in zip(mismatches, names, assumed, strict=True):
        if value == 0.0:
            raise ValueError(
                f"{mismatch} ({name}) is 0 where the controller assumes it, so that no ratio changes it: leave it out, or give it a value."
            )
    points = scipy.stats.qmc.Sobol(len(names), rng=0).random_base2(int(np.ceil(np.log2(count))))[:count]
    return dict(zip(names, (assumed * ratios_at(2.0 * points - 1.0, least, most)).T, strict=True))
