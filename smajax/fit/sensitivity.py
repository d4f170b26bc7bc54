"""How the misfit moves with every parameter: the one Jacobian behind the check, the screening and the error bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.fit.problem import Problem


@dataclass(frozen=True)
class Sensitivity:
    """At one point: the misfit (R, N) and its derivative by each of `names` (R, N, A), both over the noise."""

    names: tuple[str, ...]
    misfit: np.ndarray
    jacobian: np.ndarray
    mask: np.ndarray  # (R, N)

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Jacobian columns of `names` on the measured samples, shape (samples, len(names))."""
        picked = self.jacobian[..., [self.names.index(name) for name in names]]
        return picked[self.mask > 0]

    def residual(self) -> np.ndarray:
        """Misfit on the measured samples, shape (samples,), in units of the noise."""
        return self.misfit[self.mask > 0]


@eqx.filter_jit
def _evaluate(problem: Problem, values: jax.Array, slots: jax.Array) -> tuple[jax.Array, jax.Array]:
    def at(chosen: jax.Array) -> tuple[jax.Array, jax.Array]:
        misfit = problem.misfit(values.at[slots].set(chosen)) / problem.noise_sigma
        return misfit, misfit

    jacobian, misfit = jax.jacfwd(at, has_aux=True)(values[slots])
    return misfit, jacobian


def sensitivity(problem: Problem, values: np.ndarray, names: Sequence[str]) -> Sensitivity:
    """Misfit and Jacobian at `values` (P + 1,), by `names`. One forward-mode pass over all runs."""
    slots = jnp.asarray([problem.names.index(name) for name in names], dtype=int)
    misfit, jacobian = _evaluate(problem, jnp.asarray(values), slots)
    return Sensitivity(tuple(names), np.asarray(misfit), np.asarray(jacobian), np.asarray(problem.batch.mask))
