"""Noise of outputs estimated with the fit: what the model leaves of each, until the weights that it gives settle."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.predicted import misfits
from smajax.fit.problem import Problem
from smajax.fit.robust import NORMAL

ROUNDS = 20
SETTLED = 1e-3  # relative change of a sigma that changes no weight worth a step
LEAST = 1e-9  # of an output's largest value: a model that leaves nothing must not get all the weight


def residual_sigmas(problem: Problem, values: np.ndarray, free: int, robust: bool = False) -> np.ndarray:
    """Sigma of each output (SI) as `values` (P,) leave it, the `free` parameters and the offsets counted off.

    That of the greatest likelihood but for the count; `robust`: from the median, which samples far off do not move.
    """
    count = len(problem.batch.outputs)
    misfit, mask = misfits(problem, values[None])[0], np.asarray(problem.batch.mask) > 0
    found = np.empty(count)
    for k in range(count):
        own, here = misfit[k::count][mask[k::count]], mask[k::count]
        spent = free * own.size / max(mask.sum(), 1) + problem.offset[k] * int(here.any(axis=1).sum())
        left = np.sqrt(own.size / max(own.size - spent, 1.0))
        spread = NORMAL * float(np.median(np.abs(own))) if robust else float(np.sqrt(np.mean(own**2)))
        found[k] = max(left * spread, LEAST * float(np.abs(np.asarray(problem.batch.output)).max()), 1e-300)
    return found


def fit_with_noise(
    problem: Problem,
    first: Fit,
    estimated: Sequence[bool],
    free: int,
    fit: Callable[[Problem, np.ndarray], Fit],
    robust: bool = False,
) -> tuple[Problem, Fit]:
    """(problem with the noise of the outputs `estimated` as the fit leaves it, fit).

    `fit` is called with a problem and the values to start from. Weights and fit in turn come to the greatest likelihood
    of both, in which each sigma is profiled out: sum of n ln sigma.
    """
    found, which = first, np.asarray(estimated)
    for _ in range(ROUNDS):
        before = np.broadcast_to(np.asarray(problem.noise_sigma), which.shape)
        sigmas = np.where(which, residual_sigmas(problem, found.values, free, robust), before)
        if float(np.abs(sigmas / before - 1.0).max()) < SETTLED:
            break
        problem = eqx.tree_at(lambda one: one.noise_sigma, problem, jnp.asarray(sigmas))
        new = fit(problem, found.values)
        found = dataclasses.replace(new, steps=new.steps + found.steps)
    return problem, found
