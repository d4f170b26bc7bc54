"""Levels on which readings lie: the increment of a sensor whose steps are larger than its noise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.data.readers.table import Array

LEAST = 4.0  # noises: an increment that is smaller leaves no gaps
FEWEST = 3  # levels over the stroke
CELLS = 8  # into which the smallest increment is cut: half a noise each
# Of what normal noise about levels leaves of the periodogram, exp(-2 pi^2 sigma^2 / q^2): 0.6 at levels 6.2 noises apart, 0.98 at 30.
ON_LEVELS = 0.75
CHANCE = (
    0.01  # of readings that lie anywhere, at most, to look like that at any increment from the largest to the one found
)
FINENESS = 8  # frequencies looked at per turn over the whole stroke
MOST = 20_000  # of them
COARSER = 1.2  # ratio of the windows within which readings are counted, from one to the next
# Beyond so many noises, and such a share of the increment (the frequency is one of a few), a reading is between levels; noise leaves few there.
BETWEEN, NEAR, FEW = 3.5, 0.125, 2e-3


class _Cells(NamedTuple):
    """Of one run: numbers of the cells that were seen, in order, from the lowest of them, and readings in each."""

    where: np.ndarray
    counts: np.ndarray


def likeliest_increment(readings: Sequence[Array], sigma: float) -> float:
    """The increment at which the readings lie, in their unit; 0 where they go everywhere.

    readings: one array (n,) a run, of noise `sigma`. Every run may have its own zero. The periodogram of the readings over the
    scale: 1 where all lie on levels, about one over the root of their number where they go everywhere. So that a stroke counts and
    not how long the reading rests at its ends, every reading weighs one over the number of those within half an increment of it:
    the weights of a run add up to the levels that it was on. Of a run with m levels the squared sum of turns over m has by chance
    the exponential distribution, and several runs' together that of the sum (Scargle 1982). Rests at even distances, as of a staircase of
    set points, are told from levels by the way between them: a sensor's readings are on levels there too, but for one at each change. Of rests
    less than nine noises apart, between which the reading passes in a few samples, this is not to be seen, and they count as levels.
    """
    stroke = max(float(np.ptp(one)) for one in readings)
    finest = max(LEAST * sigma, stroke * FINENESS / MOST)
    if stroke <= FEWEST * finest:
        return 0.0
    cell = finest / CELLS
    frequency, strength, surprise = _periodogram([_cells(one, cell) for one in readings], cell, stroke, finest)
    best = int(np.argmax(strength))
    tried = 1.0 + best / FINENESS
    chance = tried * float(scipy.special.gammaincc(len(readings), surprise[best]))
    increment = float(1.0 / frequency[best])
    if not (strength[best] > ON_LEVELS * _left_by(sigma, increment) and chance < CHANCE):
        return 0.0
    # Where the noise is less than was said, more is asked.
    own = min(sigma, _scatter(readings, increment))
    found = strength[best] > ON_LEVELS * _left_by(own, increment) and _on_levels_throughout(readings, increment, own)
    return increment if found and _in_every_run(readings, increment, own, cell) else 0.0


def _left_by(sigma: float, increment: float) -> float:
    """Of the periodogram at the increment, by normal noise about levels: exp(-2 pi^2 sigma^2 / q^2)."""
    return math.exp(-2.0 * (math.pi * sigma / increment) ** 2)


def _from_levels(one: Array, increment: float) -> tuple[Array, Array]:
    """(number of the nearest level, distance from it in levels) of each reading of a run, whose zero is that of most readings."""
    turns = np.exp(2j * np.pi * (one - one[0]) / increment)
    phase = float(np.angle(turns.sum())) / (2.0 * np.pi)
    levels = (one - one[0]) / increment - phase
    nearest = np.round(levels)
    return nearest, levels - nearest


def _scatter(readings: Sequence[Array], increment: float) -> float:
    """Root mean square distance of the readings from their levels."""
    away = np.concatenate([_from_levels(one, increment)[1] for one in readings])
    return increment * float(np.sqrt(np.mean(away**2)))


def _in_every_run(readings: Sequence[Array], increment: float, sigma: float, cell: float) -> bool:
    """Whether each run that goes over `FEWEST` levels is on levels by itself."""
    least, half = 0.5 * ON_LEVELS * _left_by(sigma, increment), max(round(0.5 * increment / cell), 1)
    for one in readings:
        if np.ptp(one) > FEWEST * increment:
            run = _cells(one, cell)
            weight = _weights(run, half)
            turns = np.exp(2j * np.pi * run.where * cell / increment)
            if abs((weight * turns).sum()) < least * weight.sum():
                return False
    return True


def _cells(readings: Array, cell: float) -> _Cells:
    where, counts = np.unique(np.round(readings / cell).astype(np.int64), return_counts=True)
    return _Cells(where - where[0], counts)


def _periodogram(runs: Sequence[_Cells], cell: float, stroke: float, finest: float) -> tuple[Array, Array, Array]:
    """(frequencies, strength, squared sums over levels added up), each (F,), from `FEWEST` levels over the stroke to the finest."""
    length = scipy.fft.next_fast_len(math.ceil(FINENESS * (stroke / cell + 1.0)), real=True)
    frequency = np.arange(length // 2 + 1) / (length * cell)
    sought = np.flatnonzero((frequency >= FEWEST / stroke) & (frequency <= 1.0 / finest))
    strength, surprise = np.zeros(len(sought)), np.zeros(len(sought))
    half = 0.5 / (frequency[sought] * cell)  # an increment, in cells
    for width, chosen in _by_width(half):
        weights = [_weights(one, width) for one in runs]
        levels = [float(one.sum()) for one in weights]
        sums = []
        for one, weight in zip(runs, weights, strict=True):
            scale = np.zeros(length)
            scale[one.where] = weight
            sums.append(np.abs(np.fft.rfft(scale))[sought[chosen]])
        strength[chosen] = np.sum(sums, axis=0) / sum(levels)
        surprise[chosen] = sum(one**2 / level for one, level in zip(sums, levels, strict=True))
    return frequency[sought], strength, surprise


def _by_width(half: Array) -> Iterator[tuple[int, np.ndarray]]:
    """(half of a window, those of `half` that it is for): windows a fifth apart, since each costs a transform."""
    classes = np.floor(np.log(half) / math.log(COARSER))
    for one in np.unique(classes):
        yield max(math.floor(COARSER**one), 1), np.flatnonzero(classes == one)


def _weights(run: _Cells, half: int) -> np.ndarray:
    """Readings in each cell over those in the cells at most `half` from it."""
    total = np.concatenate([[0], np.cumsum(run.counts)])
    last = np.searchsorted(run.where, run.where + half, side="right")
    return np.asarray(run.counts / (total[last] - total[np.searchsorted(run.where, run.where - half)]))


def _on_levels_throughout(readings: Sequence[Array], increment: float, sigma: float) -> bool:
    """Whether no more readings are between levels than one at each change of the level."""
    between, changes, least = 0, 0, max(BETWEEN * sigma, NEAR * increment)
    for one in readings:
        nearest, away = _from_levels(one, increment)
        between += int((np.abs(away) * increment > least).sum())
        changes += int(np.abs(np.diff(nearest)).sum())
    return between <= changes + FEW * sum(len(one) for one in readings)
