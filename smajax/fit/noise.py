"""Noise of outputs estimated with the fit: the rms of each output's residual, repeated until the weights settle."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import Problem
from smajax.fit.robust import NORMAL

ROUNDS = 20
SETTLED = 1e-3  # relative change of a sigma; a smaller one is not worth a fit
LEAST = 1e-9  # of an output's largest value: an output without a residual must not get all the weight


def residual_sigmas(problem: Problem, values: np.ndarray, free: int, robust: bool = False) -> np.ndarray:
    """Sigma of each output (SI) from the residual at `values` (P,), less the degrees of freedom of `free` and offsets.

    The maximum-likelihood estimate but for the degrees of freedom; `robust`: from the median, which ignores outliers.
    """
    count = len(problem.batch.outputs)
    misfit, mask = misfits(problem, values[None])[0], np.asarray(problem.batch.mask) > 0
    sigmas = np.empty(count)
    for k in range(count):
        residual, measured = misfit[k::count][mask[k::count]], mask[k::count]
        used = free * residual.size / max(mask.sum(), 1) + problem.offset[k] * int(measured.any(axis=1).sum())
        correction = np.sqrt(residual.size / max(residual.size - used, 1.0))
        spread = NORMAL * float(np.median(np.abs(residual))) if robust else float(np.sqrt(np.mean(residual**2)))
        sigmas[k] = max(correction * spread, LEAST * float(np.abs(np.asarray(problem.batch.output)).max()), 1e-300)
    return sigmas


def fit_with_noise(
    problem: Problem,
    first: Fit,
    estimated: Sequence[bool],
    free: int,
    fit: Callable[[Problem, np.ndarray], Fit],
    robust: bool = False,
) -> tuple[Problem, Fit]:
    """(problem with the noise of the outputs `estimated` from the residual, fit).

    `fit` is called with a problem and the values to start from. Alternating weights and fit maximises the
    likelihood of both, in which each sigma is profiled out: sum of n ln sigma.
    """
    best, which = first, np.asarray(estimated)
    for _ in range(ROUNDS):
        before = np.broadcast_to(np.asarray(problem.noise_sigma), which.shape)
        sigmas = np.where(which, residual_sigmas(problem, best.values, free, robust), before)
        if float(np.abs(sigmas / before - 1.0).max()) < SETTLED:
            break
        problem = problem.with_noise(sigmas)
        new = fit(problem, best.values)
        best = dataclasses.replace(new, steps=new.steps + best.steps)
    return problem, best
