"""Huber's loss by weights that are computed again: samples far off count less, and no sample is thrown away."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.predicted import misfits
from smajax.fit.problem import Problem

BEND = 1.345  # deviations from where on a sample counts less: 95 % as good as least squares where the noise is normal
ROUNDS = 20
SETTLED = 1e-2  # weights that change by less
NORMAL = 1.4826  # deviation over the median of the absolute, for a normal distribution


def huber_weights(misfit: np.ndarray, mask: np.ndarray, outputs: int = 1) -> np.ndarray:
    """Weights between 0 and 1, of the shape of `misfit` (series, N).

    The spread of each of the `outputs`, which follow each other in every run, is taken from the misfit itself.
    """
    weights = np.zeros_like(misfit)
    for k in range(outputs):
        own, here = misfit[k::outputs], mask[k::outputs] > 0
        spread = NORMAL * np.median(np.abs(own[here]))
        far = np.abs(own) / (BEND * max(float(spread), 1e-300))
        weights[k::outputs] = np.where(here, 1.0 / np.maximum(far, 1.0), 0.0)
    return weights


def unweighted_misfit(weighted: Problem, values: np.ndarray) -> np.ndarray:
    """Misfit over the noise, (series, N), each run's offset that of the weights: a plain mean is drawn by what is far off."""
    root = np.asarray(weighted.batch.mask)
    return misfits(weighted, values[None])[0] / np.where(root > 0.0, root, 1.0) / np.asarray(weighted.noise)


def robust_fit(problem: Problem, first: Fit, fit: Callable[[Problem, np.ndarray], Fit]) -> tuple[Problem, Fit]:
    """(problem with the weights in its mask, fit): `fit` is called with a problem and the values to start from."""
    mask, weighted, found = np.asarray(problem.batch.mask), problem, first
    before = mask
    for _ in range(ROUNDS):
        misfit = unweighted_misfit(weighted, found.values)
        weights = huber_weights(misfit, mask, len(problem.batch.outputs))
        weighted = eqx.tree_at(lambda one: one.batch.mask, problem, jnp.asarray(np.sqrt(weights)))
        found = fit(weighted, found.values)
        if float(np.abs(weights - before).max()) < SETTLED:
            break
        before = weights
    return weighted, found


def _most(misfit: np.ndarray) -> float:
    """From where on a sample counts less."""
    return max(BEND * NORMAL * float(np.median(np.abs(misfit))), 1e-300)


def bent(misfit: np.ndarray) -> np.ndarray:
    """A residual with what is far off brought to where it counts no more: outliers hide a memory."""
    most = _most(misfit)
    return np.clip(misfit, -most, most)


def robust_variance(misfit: np.ndarray) -> float:
    """Of an M-estimate by these residuals, over that of the design alone: mean psi^2 / (mean psi')^2 (Huber 1981)."""
    inside = float(np.mean(np.abs(misfit) < _most(misfit)))
    return float(np.mean(np.square(bent(misfit))) / max(inside, 1e-3) ** 2)
