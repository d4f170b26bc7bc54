"""Huber's loss by iteratively reweighted least squares: outliers count less, and no sample is discarded."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import Problem

BEND = 1.345  # deviations beyond which a sample counts less: 95 % as efficient as least squares for normal noise
ROUNDS = 20
SETTLED = 1e-2  # weights that change by less
NORMAL = 1.4826  # deviation over the median of the absolute, for a normal distribution


def huber_weights(misfit: np.ndarray, mask: np.ndarray, outputs: int = 1) -> np.ndarray:
    """Weights between 0 and 1, of the shape of `misfit` (series, N).

    The spread of each of the `outputs`, which follow each other in every run, is taken from the misfit itself.
    """
    weights = np.zeros_like(misfit)
    for k in range(outputs):
        residual, valid = misfit[k::outputs], mask[k::outputs] > 0
        spread = NORMAL * np.median(np.abs(residual[valid]))
        far = np.abs(residual) / (BEND * max(float(spread), 1e-300))
        weights[k::outputs] = np.where(valid, 1.0 / np.maximum(far, 1.0), 0.0)
    return weights


def unweighted_misfit(weighted: Problem, values: np.ndarray) -> np.ndarray:
    """Misfit over the noise, (series, N), each run's offset by the weights: outliers shift a plain mean."""
    root = np.asarray(weighted.batch.mask)
    return misfits(weighted, values[None])[0] / np.where(root > 0.0, root, 1.0) / np.asarray(weighted.noise)


def robust_fit(problem: Problem, first: Fit, fit: Callable[[Problem, np.ndarray], Fit]) -> tuple[Problem, Fit]:
    """(problem with the weights in its mask, fit): `fit` is called with a problem and the values to start from."""
    mask, weighted, fitted = np.asarray(problem.batch.mask), problem, first
    previous = mask
    for _ in range(ROUNDS):
        misfit = unweighted_misfit(weighted, fitted.values)
        weights = huber_weights(misfit, mask, len(problem.batch.outputs))
        weighted = eqx.tree_at(lambda one: one.batch.mask, problem, jnp.asarray(np.sqrt(weights)))
        fitted = fit(weighted, fitted.values)
        if float(np.abs(weights - previous).max()) < SETTLED:
            break
        previous = weights
    return weighted, fitted


def _most(misfit: np.ndarray) -> float:
    """From where on a sample counts less."""
    return max(BEND * NORMAL * float(np.median(np.abs(misfit))), 1e-300)


def clipped(misfit: np.ndarray) -> np.ndarray:
    """A residual with its outliers clipped to where the loss turns linear: they hide an autocorrelation."""
    most = _most(misfit)
    return np.clip(misfit, -most, most)


def robust_variance(misfit: np.ndarray) -> float:
    """Of an M-estimate by these residuals, over that of the design alone: mean psi^2 / (mean psi')^2 (Huber 1981)."""
    inside = float(np.mean(np.abs(misfit) < _most(misfit)))
    return float(np.mean(np.square(clipped(misfit))) / max(inside, 1e-3) ** 2)
