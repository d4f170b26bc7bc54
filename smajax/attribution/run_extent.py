"""How far the runs of a problem go: what tells where, and whether, to look for an effect."""

from __future__ import annotations

import numpy as np

from smajax.data.readers.resolution_levels import likeliest_increment
from smajax.fit.problem import Problem
from smajax.model.effects.candidate import Extent


def extent_of(problem: Problem) -> Extent:
    """Length of a typical run, range of all readings, the increment at which they lie, and the lowest and highest of them."""
    batch = problem.batch
    mask = np.asarray(batch.mask) > 0
    readings = [row[valid] for row, valid in zip(problem.measured, mask, strict=True) if valid.any()]
    stroke = max(float(np.ptp(one)) for one in readings)
    increment = likeliest_increment(readings, float(np.median(problem.noise)))
    lowest, highest = (float(end([end(one) for one in readings])) for end in (np.min, np.max))
    return Extent(float(np.median(mask.sum(axis=1)) * batch.dt), stroke, increment, lowest, highest)
