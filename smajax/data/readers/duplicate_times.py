"""Samples that a logger wrote more than once at the same time."""

from __future__ import annotations

from typing import Literal

import numpy as np

from smajax.data.readers.table import Array

Repeated = Literal["refuse", "mean", "last"]


def once(time: Array, values: Array, how: Repeated) -> tuple[Array, Array, int]:
    """(time, values, number of samples taken out): each time once, where samples at one time follow each other.

    Samples that repeat the value as well are taken out always; where values differ, their mean or the last one is taken, or,
    with `refuse`, all are left, so that the check of the time names the place. Shapes (n,) to (m,).
    """
    same = np.diff(time) == 0.0
    if not same.any():
        return time, values, 0
    equal = (np.diff(values) == 0.0) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    if how == "refuse":
        distinct = np.concatenate([[True], ~(same & equal)])
        return time[distinct], values[distinct], int((~distinct).sum())
    group = np.concatenate([[0], np.cumsum(~same)])
    starts = np.flatnonzero(np.concatenate([[True], ~same]))
    ends = np.append(starts[1:], time.size) - 1
    if how == "last":
        return time[starts], values[ends], int(time.size - starts.size)
    sums, counts = np.bincount(group, values), np.bincount(group)
    return time[starts], sums / counts, int(time.size - starts.size)
