"""Box bounds by an invertible map, so that an unconstrained least-squares solver stays inside them."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

# How near to a bound a start may lie, as a share of the box: at the bound itself the map has no slope.
EDGE = 1e-3
# A fitted value nearer to a bound than this share of the box counts as held by it.
AT_BOUND = 2e-3


def bounded(free: Float[Array, "*p"], low: Float[Array, "*p"], high: Float[Array, "*p"]) -> Float[Array, "*p"]:
    """From the whole line into (low, high)."""
    return low + (high - low) * jax.nn.sigmoid(free)


def unbounded(value: Float[Array, "*p"], low: Float[Array, "*p"], high: Float[Array, "*p"]) -> Float[Array, "*p"]:
    """The inverse of `bounded`; a value on or over a bound is first moved inside by `EDGE` of the box."""
    share = jnp.clip((value - low) / (high - low), EDGE, 1.0 - EDGE)
    return jnp.log(share) - jnp.log1p(-share)
