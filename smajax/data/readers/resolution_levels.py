"""Levels on which readings lie: the increment of a sensor whose steps are larger than its noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.data.readers.table import Array

LEAST = 4.0  # noises: an increment that is smaller leaves no gaps
FEWEST = 3  # levels over the stroke
CELL = 0.5  # noises: a cell of the scale counts once, however long the reading rests in it
ON_LEVELS = 0.75  # of the periodogram: about that of steps of nine noises; ends of a stroke where it rests make 0.65
FINENESS = 8  # frequencies looked at per turn over the whole stroke
MOST = 20_000  # of them
BLOCK = 64  # at a time


def likeliest_increment(readings: Sequence[Array], sigma: float) -> float:
    """The increment at which the cells of the scale that were seen lie, in the unit of the readings; 0 where they go everywhere.

    readings: one array (n,) a run, of noise `sigma`. Every run may have its own zero. The periodogram of the cells over
    the scale: 1 where all lie on levels, about one over the root of their number where the readings go everywhere.
    """
    stroke = max(float(np.ptp(one)) for one in readings)
    finest = max(LEAST * sigma, stroke * FINENESS / MOST)
    if stroke <= FEWEST * finest:
        return 0.0
    frequency = np.arange(FEWEST / stroke, 1.0 / finest, 1.0 / (FINENESS * stroke))
    cells = [CELL * sigma * np.unique(np.round(one / (CELL * sigma))) for one in readings]
    seen = sum(len(one) for one in cells)
    # Some at a time: all of them for a long log would not fit in memory.
    blocks = np.array_split(frequency, -(-len(frequency) // BLOCK))
    strength = np.concatenate([_strength(block, cells) for block in blocks]) / seen
    best = int(np.argmax(strength))
    return float(1.0 / frequency[best]) if strength[best] > ON_LEVELS else 0.0


def _strength(frequency: Array, cells: Sequence[Array]) -> Array:
    """Size of the sums of turns at each frequency (F,), every run by itself, added up."""
    turns = (np.exp(2j * np.pi * np.outer(frequency, one)).sum(axis=1) for one in cells)
    return np.sum([np.abs(one) for one in turns], axis=0)
