"""Levels on which readings lie: the increment of a sensor whose steps are larger than its noise."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.data.readers.table import Array

Cells = tuple[np.ndarray, np.ndarray]  # numbers of the cells that were seen, in order, and readings in each
LEAST = 4.0  # noises: an increment that is smaller leaves no gaps
FEWEST = 3  # levels over the stroke
CELL = 0.5  # noises: of the cells into which the scale is cut
ON_LEVELS = 0.75  # of the periodogram: normal noise about levels 8.3 noises apart, exp(-2 pi^2 / 8.3^2)
CHANCE = (
    0.01  # of readings that lie anywhere, at most, to look like that at any increment from the largest to the one found
)
FINENESS = 8  # frequencies looked at per turn over the whole stroke
MOST = 20_000  # of them
BLOCK = 64  # at a time


def likeliest_increment(readings: Sequence[Array], sigma: float) -> float:
    """The increment at which the readings lie, in their unit; 0 where they go everywhere.

    readings: one array (n,) a run, of noise `sigma`. Every run may have its own zero. The periodogram of the readings over the
    scale: 1 where all lie on levels, about one over the root of their number where they go everywhere. So that a stroke counts and
    not how long the reading rests where, every reading weighs one over the number of those within half an increment of it:
    the weights of a run add up to the levels that it was on. Of a run with m levels the squared sum of turns over m has by chance
    the exponential distribution, and several runs' together that of the sum (Scargle 1982).
    """
    stroke = max(float(np.ptp(one)) for one in readings)
    finest = max(LEAST * sigma, stroke * FINENESS / MOST)
    if stroke <= FEWEST * finest:
        return 0.0
    frequency = np.arange(FEWEST / stroke, 1.0 / finest, 1.0 / (FINENESS * stroke))
    cell = CELL * sigma
    cells = [np.unique(np.round(one / cell).astype(np.int64), return_counts=True) for one in readings]
    strength, surprise = _periodogram(frequency, cells, cell)
    best = int(np.argmax(strength))
    tried = 1.0 + best / FINENESS
    chance = tried * float(scipy.special.gammaincc(len(readings), surprise[best]))
    return float(1.0 / frequency[best]) if strength[best] > ON_LEVELS and chance < CHANCE else 0.0


def _periodogram(frequency: Array, cells: Sequence[Cells], cell: float) -> tuple[Array, Array]:
    """(strength, squared sums over levels added up), both (F,), of runs with these cells."""
    strength, surprise = np.zeros_like(frequency), np.zeros_like(frequency)
    half = np.array([max(math.floor(one), 1) for one in 0.5 / (frequency * cell)])
    for width in np.unique(half):
        weighed = [(cell * where, _weights(where, counts, int(width))) for where, counts in cells]
        levels = [float(weight.sum()) for _, weight in weighed]
        # Some at a time: all of them for a long log would not fit in memory.
        chosen = np.flatnonzero(half == width)
        for block in np.array_split(chosen, -(-len(chosen) // BLOCK)):
            sums = [np.abs(np.exp(2j * np.pi * np.outer(frequency[block], at)) @ weight) for at, weight in weighed]
            strength[block] = np.sum(sums, axis=0) / sum(levels)
            surprise[block] = sum(one**2 / level for one, level in zip(sums, levels, strict=True))
    return strength, surprise


def _weights(where: np.ndarray, counts: np.ndarray, half: int) -> np.ndarray:
    """Of the cells `where`, in order: readings in each over those at most `half` cells from it."""
    total = np.concatenate([[0], np.cumsum(counts)])
    return counts / (
        total[np.searchsorted(where, where + half, side="right")] - total[np.searchsorted(where, where - half)]
    )
