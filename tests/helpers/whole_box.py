"""Points of all that a system declares, for tests of what holds everywhere."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from smajax.core.parameters import parameters
from smajax.model.system import System
from smajax.model.wire.order import ORDER


def whole_box(system: System, count: int, seed: int) -> dict[str, np.ndarray]:
    """Points of all that is declared, by logarithm where that is above zero; what has an order is put into it."""
    table = parameters(system)
    shares = qmc.Sobol(len(table), rng=seed).random(count)
    box = {}
    for share, (name, entry) in zip(shares.T, table.items(), strict=True):
        wide = entry.low * (entry.high / entry.low) ** share if entry.low > 0.0 else None
        box[name] = entry.low + share * (entry.high - entry.low) if wide is None else wide
    for lower, higher, _ in ORDER:
        if lower in box:
            low, high = np.minimum(box[lower], box[higher]), np.maximum(box[lower], box[higher])
            box[lower], box[higher] = low, np.maximum(high, np.nextafter(low, np.inf))
    return box
