"""Is a residual noise? Autocorrelation, whiteness, and how many independent samples there are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft, special

LAGS = 20
# Products from which on sums over lags are taken by Fourier transform: they grow as the square of the samples.
MANY = 10**7
ROUNDING = 1e-14
WHITE = 0.01  # a residual whose whiteness has a smaller p-value has structure


def autocorrelation(series: np.ndarray, lags: int) -> np.ndarray:
    """Autocorrelation at lags 0..`lags` of one run's residual (n,), mean removed."""
    centred = series - series.mean()
    power = float(centred @ centred)
    # Rounding errors of a constant are no signal.
    if power <= len(series) * (ROUNDING * float(np.abs(series).max(initial=0.0))) ** 2:
        return np.concatenate([[1.0], np.zeros(lags)])
    reach = min(lags, len(series) - 1)
    if reach * len(series) > MANY:
        size = fft.next_fast_len(len(series) + reach, real=True)
        sums = fft.irfft(np.abs(fft.rfft(centred, size)) ** 2, size)[: reach + 1]
        return np.concatenate([sums / power, np.zeros(lags - reach)])
    values = [1.0] + [float(centred[:-lag] @ centred[lag:]) / power for lag in range(1, reach + 1)]
    return np.asarray(values + [0.0] * (lags - reach))


def whiteness_p_value(runs: Sequence[np.ndarray], lags: int = LAGS) -> float:
    """Ljung-Box over all runs at once: the probability of such autocorrelations in white noise.

    Q = sum over runs of n (n + 2) sum_k r_k^2 / (n - k), chi-square with as many degrees of freedom
    as lags were taken over all runs.
    """
    statistic, freedom = _ljung_box(runs, lags)
    return float(special.chdtrc(freedom, statistic)) if freedom else 1.0


def _ljung_box(runs: Sequence[np.ndarray], lags: int) -> tuple[float, int]:
    """(Q, lags over all runs)."""
    statistic, freedom = 0.0, 0
    for run in runs:
        n = len(run)
        if n < 2:
            continue  # one sample has no neighbour
        reach = max(1, min(lags, n // 2))
        r = autocorrelation(run, reach)
        statistic += n * (n + 2) * float(np.sum(r[1:] ** 2 / (n - np.arange(1, reach + 1))))
        freedom += reach
    return statistic, freedom


class FirstOrder(NamedTuple):
    """A series as the noise of a first-order filter, AR(1): r_k = a r_(k-1) + e_k."""

    coefficient: float  # a
    sigma: float  # of e, in the unit of the series
    p_value: float  # probability of such autocorrelations of e in white noise: small where AR(1) is not enough


def first_order(runs: Sequence[np.ndarray], lags: int = LAGS) -> FirstOrder:
    """The AR(1) nearest to all runs at once, each about its mean, by least squares; Ljung-Box on the innovations e."""
    centred = [run - run.mean() for run in runs if len(run) > 1]
    power = sum(float(run[:-1] @ run[:-1]) for run in centred)
    if power == 0.0:
        return FirstOrder(0.0, 0.0, 1.0)
    coefficient = sum(float(run[1:] @ run[:-1]) for run in centred) / power
    innovations = [run[1:] - coefficient * run[:-1] for run in centred]
    statistic, freedom = _ljung_box(innovations, lags)
    sigma = float(np.sqrt(np.mean(np.concatenate(innovations) ** 2)))
    return FirstOrder(coefficient, sigma, float(special.chdtrc(freedom - 1, statistic)) if freedom > 1 else 1.0)


def correlation_time(runs: Sequence[np.ndarray]) -> float:
    """Samples per independent sample, at least 1: 1 + 2 sum of autocorrelations up to the first that is not positive."""
    total, weight = 0.0, 0
    for run in runs:
        reach = max(1, len(run) // 4)
        r = autocorrelation(run, reach)[1:]
        negative = np.flatnonzero(r <= 0.0)
        stop = negative[0] if len(negative) else len(r)
        total += len(run) * (1.0 + 2.0 * float(r[:stop].sum()))
        weight += len(run)
    return max(1.0, total / weight)


def bartlett_sum(scores: np.ndarray, lags: int) -> np.ndarray:
    r"""$\sum_{|l| \le L} (1 - |l| / (L + 1)) \sum_t s_t s_{t+l}^T$ of one run's scores (n, p), L `lags`, fewer than n: (p, p)."""
    count = len(scores)
    weights = 1.0 - np.arange(lags + 1) / (lags + 1.0)
    if lags * scores.size > MANY:
        size = fft.next_fast_len(count + lags, real=True)
        around = np.zeros(size)
        around[: lags + 1], around[size - lags :] = weights, weights[:0:-1]
        near = fft.irfft(fft.rfft(scores, size, axis=0) * fft.rfft(around)[:, None], size, axis=0)[:count]
        product = scores.T @ near
        return np.asarray(0.5 * (product + product.T))
    total = scores.T @ scores
    for lag in range(1, lags + 1):
        cross = scores[:-lag].T @ scores[lag:]
        total += weights[lag] * (cross + cross.T)
    return np.asarray(total)


def on_samples(residual: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """A residual of the measured samples (n,) where they are, zero elsewhere: (series, N), as the mask."""
    found = np.zeros(mask.shape)
    found[mask > 0] = residual
    return found


def split_runs(misfit: np.ndarray, mask: np.ndarray) -> list[np.ndarray]:
    """Misfit and mask, (series, N) -> one array of measured samples per series that has any."""
    return [row[valid > 0] for row, valid in zip(misfit, mask, strict=True) if valid.any()]
