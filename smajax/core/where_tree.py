"""`jnp.where` of whole pytrees."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp


def where_tree(condition: Any, one: Any, other: Any) -> Any:
    """Every leaf of `one` where the condition holds, of `other` where it does not; both of one structure."""
    return jax.tree.map(lambda first, second: jnp.where(condition, first, second), one, other)
