"""What is known of parameters before the runs, as residuals beside those of the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.experiment.record import Prior


class Priors(eqx.Module):
    """Normal distributions of K entries of the parameter vector, or of their logarithms."""

    slots: tuple[int, ...] = eqx.field(static=True)
    logarithmic: tuple[bool, ...] = eqx.field(static=True)
    mean: Float[Array, " prior"]
    sigma: Float[Array, " prior"]  # in the parameter's unit, or of the logarithm

    @classmethod
    def of(cls, names: Sequence[str], known: Mapping[str, Prior]) -> Priors:
        """`known` by name; names that are not among `names` are left out."""
        here = {names.index(name): prior for name, prior in known.items() if name in names}
        means, sigmas = (np.asarray([getattr(prior, part) for prior in here.values()]) for part in ("mean", "sigma"))
        logarithmic = tuple(prior.logarithmic for prior in here.values())
        return cls(tuple(here), logarithmic, jnp.asarray(means, dtype=float), jnp.asarray(sigmas, dtype=float))

    def rows(self, values: Float[Array, " parameter"]) -> Float[Array, " prior"]:
        r"""$(\theta - \mu)/\sigma$ or $\ln(\theta/\mu)/\sigma$: their squares are minus twice the log-density."""
        at = values[jnp.asarray(self.slots, dtype=int)]
        bent = np.asarray(self.logarithmic, dtype=bool)
        # A value at zero is infinitely far off; a finite one lets a fit come back from a bound there.
        plain = jnp.log(jnp.maximum(jnp.where(bent, at / jnp.where(bent, self.mean, 1.0), 1.0), 1e-12))
        return jnp.where(bent, plain, at - self.mean) / self.sigma
