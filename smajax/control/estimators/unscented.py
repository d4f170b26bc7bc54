r"""Unscented prediction: points about the mean pass through the transition, no derivative is taken.

$2n$ points of equal weight at $\pm\sqrt n$ times the columns of a root of the covariance (kappa = 0 of the unscented
transform): no weight is negative, so neither is the covariance.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from smajax.control.estimators.kalman import AbstractPrediction, Belief, Matrix, Transition, symmetric

# Share of each variance that is added before the root is taken: a covariance whose correlations are 1 has none.
ROUNDINGS = 100.0


def _root(covariance: Matrix) -> Matrix:
    """Lower triangle whose square is the covariance, of the correlations and so whatever the units."""
    tiny = jnp.finfo(covariance.dtype).tiny ** 0.5
    spread = jnp.sqrt(jnp.maximum(jnp.diag(covariance), tiny))
    correlation = covariance / jnp.outer(spread, spread)
    size = covariance.shape[0]
    jitter = size * ROUNDINGS * jnp.finfo(covariance.dtype).eps
    return spread[:, None] * jnp.linalg.cholesky(correlation + jitter * jnp.eye(size, dtype=covariance.dtype))


class Unscented(AbstractPrediction):
    """Mean and covariance of what the transition makes of the points; the rest is that of the mean's own transition."""

    def predicted(self, transition: Transition, belief: Belief, process_noise: Matrix) -> tuple[Belief, Any]:
        size = belief.mean.size
        away = jnp.sqrt(1.0 * size) * _root(belief.covariance).T
        points = jnp.concatenate([belief.mean[None], belief.mean + away, belief.mean - away])
        after, rest = jax.vmap(transition)(points)
        mean = after[1:].mean(axis=0)
        off = after[1:] - mean
        covariance = symmetric(off.T @ off / (2 * size) + process_noise)
        return Belief(mean, covariance), jax.tree.map(lambda leaf: leaf[0], rest)
