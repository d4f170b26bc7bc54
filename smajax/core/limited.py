"""Holding a value in a range, with the derivative that a user of its ends wants."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, ""]


def limited(value: Scalar, low: Scalar | float, high: Scalar | float) -> Scalar:
    """`value` held in [low, high]; at the ends themselves the derivative is that of the inside (`clip` halves it).

    An end that is no number gives none: a comparison with it would pass for "inside".
    """
    held = jnp.where(value < low, low, jnp.where(value > high, high, value))
    return jnp.where(jnp.isnan(low) | jnp.isnan(high), jnp.nan, held)
