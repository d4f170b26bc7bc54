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
ROUNDS = 20
SETTLED = 1e-2  # weights that change by less
NORMAL = 1.4826  # deviation over the median of the absolute, for a normal distribution


def huber_weights(misfit: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Weights between 0 and 1, of the shape of `misfit` (R, N); the spread is taken from the misfit itself."""
    spread = NORMAL * np.median(np.abs(misfit[mask > 0]))
    far = np.abs(misfit) / (BEND * max(float(spread), 1e-300))
    return np.where(mask > 0, 1.0 / np.maximum(far, 1.0), 0.0)


def unweighted_misfit(weighted: Problem, values: np.ndarray) -> np.ndarray:
    """Misfit over the noise, (R, N), each run's offset that of the weights: a plain mean is drawn by what is far off."""
    root = np.asarray(weighted.batch.mask)
    return misfits(weighted, values[None])[0] / np.where(root > 0.0, root, 1.0) / float(weighted.noise_sigma)


def robust_fit(problem: Problem, first: Fit, fit: Callable[[Problem, np.ndarray], Fit]) -> tuple[Problem, Fit]:
    """(problem with the weights in its mask, fit): `fit` is called with a problem and the values to start from."""
    mask, weighted, found = np.asarray(problem.batch.mask), problem, first
    before = mask
    for _ in range(ROUNDS):
        misfit = unweighted_misfit(weighted, found.values) * float(problem.noise_sigma)
        weights = huber_weights(misfit, mask)
        weighted = eqx.tree_at(lambda one: one.batch.mask, problem, jnp.asarray(np.sqrt(weights)))
        found = fit(weighted, found.values)
        if float(np.abs(weights - before).max()) < SETTLED:
            break
        before = weights
    return weighted, found


def robust_variance(misfit: np.ndarray) -> float:
    """Of an M-estimate by these residuals, over that of the design alone: mean psi^2 / (mean psi')^2 (Huber 1981)."""
    spread = NORMAL * float(np.median(np.abs(misfit)))
    far = misfit / max(BEND * spread, 1e-300)
    bent = np.asarray(BEND * spread * np.clip(far, -1.0, 1.0))
    return float(np.mean(np.square(bent)) / max(float(np.mean(np.abs(far) < 1.0)), 1e-3) ** 2)
