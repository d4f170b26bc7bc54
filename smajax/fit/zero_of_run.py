"""A run's own zero of a sensor, which is fitted to that run: the mean of what a model leaves of it."""

from __future__ import annotations

import numpy as np


def with_zero(measured: np.ndarray, simulated: np.ndarray, offset: bool) -> tuple[np.ndarray, float, float]:
    """(simulated with the zero, the zero, rms of what is left), SI, of one sensor in one run, (n,) each; nan where a sample is missing.

    offset: whether the sensor has a zero of its own in each run; else it is 0, as without a sample, where the rms is nan.
    """
    there = np.isfinite(measured)
    zero = float(np.mean((measured - simulated)[there])) if offset and there.any() else 0.0
    left = (measured - (simulated + zero))[there]
    return simulated + zero, zero, float(np.sqrt(np.mean(left**2))) if there.any() else float("nan")
