"""Points that fill a cube evenly."""

from __future__ import annotations

import math

import numpy as np
import scipy  # its parts are imported when they are first used


def sobol_points(count: int, dimensions: int, seed: int) -> np.ndarray:
    """(count, dimensions) from 0 to 1, scrambled: drawn up to a power of two, where the sequence is balanced, and cut (scipy warns of any other count). Fewer are the first of more."""
    points = scipy.stats.qmc.Sobol(dimensions, rng=seed).random_base2(math.ceil(math.log2(count)))
    return np.asarray(points[:count])
