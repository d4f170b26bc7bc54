"""White measurement noise of a signal, estimated from the signal alone."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from smajax.data.readers.table import Array

# Sigma of a normal variable over its median absolute value.
MAD_TO_SIGMA = 1.4826
# Fewer differences than this leave the estimate to chance.
LEAST_SAMPLES = 8
# Sum of squares of the binomial weights of the difference of that order: its variance in white noise of variance 1.
DIFFERENCE_VARIANCE = {2: 6.0, 3: 20.0}
# Increment over noise from which on the median of differences is a matter of the levels: below, they move it by 3 % at most.
LEVELS_SHOW = 0.1
# Sigmas beyond which a difference counts as one of that size: a jump or a bend of the signal, not noise.
WINSORISED_AT = 2.5
# Mean square of a normal variable of variance 1 that is winsorised there.
WINSORISED_SQUARE = float(
    1.0
    - 2.0 * norm.sf(WINSORISED_AT)
    - 2.0 * WINSORISED_AT * norm.pdf(WINSORISED_AT)
    + 2.0 * WINSORISED_AT**2 * norm.sf(WINSORISED_AT)
)
MOST_ROUNDS = 100


def detect_quantum(signal: Array) -> float:
    """The increment that the values of a quantised signal, shape (n,), are multiples of; 0.0 when there is none.

    Values must recur, and the gaps between neighbouring levels must be whole multiples of the smallest gap.
    """
    extent = float(np.ptp(signal)) if signal.size else 0.0
    if extent == 0.0:
        return 0.0
    levels = np.unique(signal)
    # Values that differ by rounding only are one level.
    levels = levels[np.concatenate([[True], np.diff(levels) > 1e-9 * extent])]
    if levels.size < 2 or levels.size > 0.5 * signal.size:
        return 0.0
    gaps = np.diff(levels)
    multiples = gaps / gaps.min()
    near = multiples < 20.5
    whole = np.abs(multiples - np.round(multiples)) < 0.05
    if np.mean(near) < 0.5 or np.mean(whole[near]) < 0.95:
        return 0.0
    return float(np.median(gaps[near] / np.round(multiples[near])))


def estimate_noise(signal: Array, quantum: float | None = None) -> float:
    """Robust sigma of the white noise in a uniformly sampled signal, shape (n,), in the signal's unit.

    The second and third differences of a signal that is slow against its sampling hold little but noise; their
    median absolute value, which jumps and bends do not move, gives sigma, and the lower of the two is taken. Of a
    signal in levels whose increment is comparable with that, the median is one of few values (an increment, mostly,
    whatever the noise): there the root mean square gives sigma, of differences that are winsorised at WINSORISED_AT
    sigmas (Huber, Robust Statistics, 1981, proposal 2). It includes the rounding.
    The result is at least quantum / sqrt(12), the sigma of a rounding to that quantum (`detect_quantum` of the
    signal when not given; give the sensor's own for an averaged signal, in which it cannot be seen any more).
    Raises ValueError for fewer than LEAST_SAMPLES samples.
    """
    signal = np.asarray(signal, dtype=np.float64)
    if signal.size < LEAST_SAMPLES:
        raise ValueError(
            f"got {signal.size} samples, expected at least {LEAST_SAMPLES} to estimate noise from; give the noise instead"
        )
    floor = (detect_quantum(signal) if quantum is None else quantum) / np.sqrt(12.0)
    differences = [(np.diff(signal, n=order), variance) for order, variance in DIFFERENCE_VARIANCE.items()]
    sigma = min(MAD_TO_SIGMA * float(np.median(np.abs(one))) / np.sqrt(variance) for one, variance in differences)
    increment = detect_quantum(signal)
    if increment > LEVELS_SHOW * sigma:
        sigma = min(_winsorised_sigma(one, increment) / np.sqrt(variance) for one, variance in differences)
    return float(max(sigma, floor))


def _winsorised_sigma(differences: Array, increment: float) -> float:
    """Sigma of normal `differences`, shape (n,), from their mean square with those beyond WINSORISED_AT sigmas set to it.

    Begins at the median, or at the increment where that is more: most differences of a quiet signal are zero.
    """
    sigma = max(MAD_TO_SIGMA * float(np.median(np.abs(differences))), increment)
    for _ in range(MOST_ROUNDS):
        before = sigma
        square = np.mean(np.minimum(differences**2, (WINSORISED_AT * sigma) ** 2))
        sigma = float(np.sqrt(square / WINSORISED_SQUARE))
        if abs(sigma - before) <= 1e-6 * before:
            break
    return sigma
