"""Prior distributions of parameters, as residuals beside those of the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.data.experiment.record import Prior

ArrayOf = TypeVar("ArrayOf", bound=Any)
LEAST = 1e-12  # of its mean: as near to zero as the logarithm of a value is taken


class Priors(eqx.Module):
    """Normal distributions of K entries of the parameter vector, or of their logarithms."""

    slots: tuple[int, ...] = eqx.field(static=True)
    logarithmic: tuple[bool, ...] = eqx.field(static=True)
    mean: Float[Array, " prior"]
    sigma: Float[Array, " prior"]  # in the parameter's unit, or of the logarithm

    @classmethod
    def of(cls, names: Sequence[str], priors: Mapping[str, Prior]) -> Priors:
        """`priors` by name; those of names that are not among `names` are left out."""
        by_slot = {names.index(name): prior for name, prior in priors.items() if name in names}
        means, sigmas = (np.asarray([getattr(prior, part) for prior in by_slot.values()]) for part in ("mean", "sigma"))
        logarithmic = tuple(prior.logarithmic for prior in by_slot.values())
        return cls(tuple(by_slot), logarithmic, jnp.asarray(means, dtype=float), jnp.asarray(sigmas, dtype=float))

    def rows(self, values: ArrayOf) -> ArrayOf:
        r"""$(\theta - \mu)/\sigma$ or $\ln(\theta/\mu)/\sigma$ of values (P,): (K,).

        Their squares are minus twice the log-density. Of numpy's and of JAX's arrays alike.
        """
        xp = values.__array_namespace__()
        mean, sigma, logarithmic = (
            xp.asarray(self.mean),
            xp.asarray(self.sigma),
            np.asarray(self.logarithmic, dtype=bool),
        )
        at = values[np.asarray(self.slots, dtype=int)]
        ratio = xp.where(logarithmic, at / xp.where(logarithmic, mean, 1.0), 1.0)
        # A value at zero is infinitely far off; a finite one lets a fit come back from a bound there.
        return xp.where(logarithmic, xp.log(xp.maximum(ratio, LEAST)), at - mean) / sigma

    def slopes(self, values: np.ndarray) -> np.ndarray:
        """Derivative of `rows` by every value, (K, P)."""
        logarithmic, slots = np.asarray(self.logarithmic, dtype=bool), np.asarray(self.slots, dtype=int)
        at = values[slots]
        least = LEAST * np.where(logarithmic, np.asarray(self.mean), 1.0)
        derivatives = np.zeros((len(slots), len(values)))
        inner = np.where(logarithmic, np.where(at > least, 1.0 / np.maximum(at, least), 0.0), 1.0)
        derivatives[np.arange(len(slots)), slots] = inner / np.asarray(self.sigma)
        return derivatives
