"""The band of a prediction: of the parameters' posterior, of the likely models, and of what runs left out were missed by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.fit.problem import Problem

BAND = 0.9  # share of the measured samples that are expected in the band
NORMAL = float(scipy.special.ndtri(0.5 + 0.5 * BAND))  # standard deviations on either side that have that share


NEIGHBOURS = 5  # samples on either side of one, whose means are compared
MOVED = 2.0  # noises between these means, from which on an output moves: of noise alone one sample in 600 does


class InBand(NamedTuple):
    """Shares of the measured samples inside a band, NaN without such samples: of all, and of those at which the output moves."""

    whole: float
    moving: float
    samples_moving: int


def moving(measured: np.ndarray, noise: float | np.ndarray) -> np.ndarray:
    """At which of the samples (n,) the output moves, bool: the means of its neighbours before and after differ by more than `MOVED` noises.

    noise: sigma of a sample, one or (n,). A missing sample (NaN) does not move, and those beside it are neighbours.
    """
    present = np.isfinite(measured)
    values = measured[present]
    result = np.zeros(measured.shape, dtype=bool)
    count = min(NEIGHBOURS, values.size - 1)
    if count < 1:
        return result
    # At an end a series goes on as its mirror image, in which it rests.
    sums = np.cumsum(np.concatenate([[0.0], np.pad(values - values.mean(), count, mode="reflect")]))
    at = count + np.arange(values.size)
    before, after = sums[at] - sums[at - count], sums[at + 1 + count] - sums[at + 1]
    sigma = np.broadcast_to(noise, measured.shape)[present]
    result[present] = np.abs(after - before) > count * MOVED * sigma
    return result


def in_band(measured: np.ndarray, reading: np.ndarray, half: np.ndarray, noise: float | np.ndarray) -> InBand:
    """How many of the samples (n,) lie within `half` of the reading; at rest, where nothing happens, a model is right without merit."""
    present, moves = np.isfinite(measured), moving(measured, noise)
    inside = np.abs(measured - reading) <= half

    def share(where: np.ndarray) -> float:
        return float(np.mean(inside[where])) if where.any() else float("nan")

    return InBand(share(present), share(moves), int(moves.sum()))


class Reading(NamedTuple):
    """By one model: its reading with each run's offset, its variance by the parameters, (series, N), and that offset, (series,)."""

    reading: np.ndarray
    variance: np.ndarray
    offset: np.ndarray


def reading_of(
    problem: Problem, values: np.ndarray, names: Sequence[str], deviations: np.ndarray, covariance: np.ndarray
) -> Reading:
    r"""What a model predicts of every run at its `values` (P,), with the variance $J \Sigma J^T$ of that.

    deviations (K,), covariance (K, K): sizes of the parameters `names`, SI, and their covariance over these sizes on either side.
    """
    tangents = np.zeros((1, len(names), len(values)))
    for row, name in enumerate(names):
        tangents[0, row, problem.names.index(name)] = deviations[row]
    predicted, derivatives = predicted_and_derivatives(problem, values[None], tangents)
    mask = np.asarray(problem.batch.mask) > 0
    has_offset = np.tile(problem.offset, problem.batch.runs)

    def mean(series: np.ndarray) -> np.ndarray:
        """Over the measured samples of each series that has an offset; else 0."""
        total = np.where(mask, series, 0.0).sum(axis=-1) / np.maximum(mask.sum(axis=-1), 1)
        return np.where(has_offset, total, 0.0)

    offset = mean(problem.measured - predicted[0])
    reading = predicted[0] + offset[:, None]
    if not names:
        return Reading(reading, np.zeros_like(reading), offset)
    columns = derivatives[0] - mean(derivatives[0])[..., None]
    variance = np.einsum("psn,pq,qsn->sn", columns, covariance, columns)
    return Reading(reading, np.maximum(variance, 0.0), offset)


def averaged_band(
    readings: np.ndarray, variances: np.ndarray, weights: np.ndarray, missed: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """(mean, half width of the band) of the readings (M, ..., N) of likely models, with their variances by their parameters.

    missed: the absolute error that `BAND` of the samples of runs left out stay below, which is in the band beside the variances of
    parameters and between models; broadcast against (..., N).
    """
    mean = np.tensordot(weights, readings, 1)
    between = np.tensordot(weights, (readings - mean) ** 2, 1)
    return mean, np.sqrt(NORMAL**2 * (np.tensordot(weights, variances, 1) + between) + np.square(missed))
