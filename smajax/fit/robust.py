"""Huber's loss by weights that are computed again: samples far off count less, and no sample is thrown away."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.fit.box import Fit
from smajax.fit.problem import Problem
from smajax.fit.solve import misfits

BEND = 1.345  # deviations from where on a sample counts less: 95 % as good as least squares where the noise is normal
ROUNDS = 4
NORMAL = 1.4826  # deviation over the median of the absolute, for a normal distribution


def huber_weights(misfit: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Weights between 0 and 1, of the shape of `misfit` (R, N); the spread is taken from the misfit itself."""
    spread = NORMAL * np.median(np.abs(misfit[mask > 0]))
    far = np.abs(misfit) / (BEND * max(float(spread), 1e-300))
    return np.where(mask > 0, 1.0 / np.maximum(far, 1.0), 0.0)


def robust_fit(problem: Problem, first: Fit, fit: Callable[[Problem, np.ndarray], Fit]) -> tuple[Problem, Fit]:
    """(problem with the weights in its mask, fit): `fit` is called with a problem and the values to start from."""
    mask, weighted, found = np.asarray(problem.batch.mask), problem, first
    for _ in range(ROUNDS):
        misfit = misfits(problem, found.values[None])[0]
        weights = jnp.asarray(np.sqrt(huber_weights(misfit, mask)))
        weighted = eqx.tree_at(lambda one: one.batch.mask, problem, weights)
        found = fit(weighted, found.values)
    return weighted, found
