"""The correlation of estimates from their covariance."""

from __future__ import annotations

import numpy as np


def deviations_of(covariance: np.ndarray) -> np.ndarray:
    """Standard deviation of each estimate, (K,), of a covariance (K, K) in the square of their units; 0 where that has none."""
    return np.asarray(np.sqrt(np.maximum(np.diag(covariance), 0.0)))


def correlation_of(covariance: np.ndarray) -> np.ndarray:
    """The covariance over these deviations on either side, (K, K); zero where an estimate has no spread."""
    size = deviations_of(covariance)
    size = np.where(size > 0.0, size, 1.0)
    return np.asarray(covariance / np.outer(size, size))
