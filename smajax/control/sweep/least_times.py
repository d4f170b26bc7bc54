"""Least times of a sweep: before which no command within a limit is at the set points, on each of its plants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from smajax.control.sweep.batched_loops import LoopSetup, least_times
from smajax.control.sweep.grid import Grid, loop_rows


class LeastTimes(NamedTuple):
    """Before which no command within the limit is at the set points, s; infinite: out of reach, NaN: the command has no limit."""

    limit: float  # largest command, in the drive's unit; infinite: none
    grid: np.ndarray  # of plants and set points, the grid's shape without its last axis: no gain has a part in it
    nominal: np.ndarray  # of the unperturbed plant, (set points,)


def least_times_of(setup: LoopSetup, grid: Grid, limits: Sequence[float]) -> list[LeastTimes]:
    """Of each limit; a limit given twice is run once."""
    rows = grid.rows().reshape(*grid.shape, -1)[..., 0, :].reshape(math.prod(grid.shape[:-1]), -1)
    some = np.concatenate([rows, loop_rows({}, grid.targets, plants=grid.plants)])
    found: dict[float, LeastTimes] = {}
    for limit in dict.fromkeys(limits):
        seconds = least_times(setup, some, limit) if math.isfinite(limit) else np.full(len(some), math.nan)
        found[limit] = LeastTimes(limit, seconds[: len(rows)].reshape(grid.shape[:-1]), seconds[len(rows) :])
    return [found[limit] for limit in limits]
