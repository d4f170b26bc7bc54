"""The band of a prediction: of the parameters' posterior, of the likely models, and of what runs left out were missed by."""

from __future__ import annotations

import numpy as np
from scipy import stats

BAND = 0.9  # share of the measured samples that are expected in the band
NORMAL = float(stats.norm.ppf(0.5 + 0.5 * BAND))  # standard deviations on either side that have that share


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
