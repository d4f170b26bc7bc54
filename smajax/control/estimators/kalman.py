"""Kalman's two steps for one reading at a time, and how a belief passes through a transition that is not linear."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from smajax.model.types import Scalar

Vector = Float[Array, " n"]
Matrix = Float[Array, "n n"]
# Vector at t_k -> (vector at t_{k+1}, whatever else belongs to it).
Transition = Callable[[Vector], tuple[Vector, Any]]


class Belief(eqx.Module):
    """A normal distribution of the state."""

    mean: Vector
    covariance: Matrix


class Innovation(eqx.Module):
    """What a reading was off by: its square over its variance averages 1 in a filter that knows its own errors."""

    value: Scalar  # reading - prediction, in the unit of the reading
    variance: Scalar


def symmetric(matrix: Matrix) -> Matrix:
    """Rounding must not make a covariance lean to one side."""
    return 0.5 * (matrix + matrix.T)


def propagated(covariance: Matrix, jacobian: Matrix, process_noise: Matrix) -> Matrix:
    """$A P A^T + Q$ (Elahinia 2004, eq. 4.21)."""
    return symmetric(jacobian @ covariance @ jacobian.T + process_noise)


def corrected(belief: Belief, reading: Scalar, seen: Vector, reading_variance: Scalar) -> tuple[Belief, Innovation]:
    r"""Use a reading of `seen` @ state (Elahinia 2004, eq. 4.22).

    The covariance in Joseph's form, $(I - K H) P (I - K H)^T + K R K^T$: equal to the printed $(I - K H) P$ for this
    gain, and no rounding makes it negative. A reading of NaN, a missing one, corrects nothing.
    """
    seen_with = belief.covariance @ seen
    missing = jnp.isnan(reading)
    innovation = Innovation(jnp.where(missing, 0.0, reading - seen @ belief.mean), seen @ seen_with + reading_variance)
    gain = jnp.where(missing, 0.0, seen_with / innovation.variance)
    complement = jnp.eye(seen.size, dtype=seen.dtype) - jnp.outer(gain, seen)
    covariance = symmetric(complement @ belief.covariance @ complement.T + reading_variance * jnp.outer(gain, gain))
    return Belief(belief.mean + gain * innovation.value, covariance), innovation


class AbstractPrediction(eqx.Module):
    """How a belief passes through a transition."""

    @abc.abstractmethod
    def predicted(self, transition: Transition, belief: Belief, process_noise: Matrix) -> tuple[Belief, Any]:
        """(belief after the transition, what belongs to the transition of the old mean)."""


class Linearised(AbstractPrediction):
    """Extended Kalman filter: the mean passes, and the covariance with the transition's derivative there."""

    def predicted(self, transition: Transition, belief: Belief, process_noise: Matrix) -> tuple[Belief, Any]:
        def twice(vector: Vector) -> tuple[Vector, tuple[Vector, Any]]:
            after, rest = transition(vector)
            return after, (after, rest)

        jacobian, (mean, rest) = jax.jacfwd(twice, has_aux=True)(belief.mean)
        return Belief(mean, propagated(belief.covariance, jacobian, process_noise)), rest
