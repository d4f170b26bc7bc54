"""A function of one run as JAX traces it, which both engines and the caller's own errors go through."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.engine.arguments import is_array

Function = Callable[[Any, Any], Any]


class Traced:
    """What JAX makes of `function(model, own)` for one run: the program, and how its results are put together."""

    def __init__(self, function: Function, model: Any, names: tuple[str, ...]) -> None:
        arrays, static = eqx.partition(model, is_array)
        leaves, tree = jax.tree.flatten(arrays)
        shape: list[Any] = []

        def run(*flat: jax.Array) -> list[jax.Array]:
            inputs = [like(leaf, one) for leaf, one in zip(leaves, flat, strict=False)]
            whole = eqx.combine(jax.tree.unflatten(tree, inputs), static)
            result = function(whole, dict(zip(names, flat[len(leaves) :], strict=True)))
            results, out = jax.tree.flatten(result)
            shape[:] = [out]
            return results

        none = jnp.zeros(())
        self.program = jax.make_jaxpr(run)(*map(plain, leaves), *(none for _ in names))
        self.names, self.shared, self.tree = names, len(leaves), shape[0]
        self.number = np.dtype(none.dtype)


@contextmanager
def collector_paused() -> Iterator[None]:
    """Without Python's collector of garbage, which looks at the millions of objects of a program again and again: an eighth of the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _is_key(leaf: Any) -> bool:
    return jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def plain(leaf: Any) -> Any:
    """The numbers of a random key; anything else as it is."""
    return jax.random.key_data(leaf) if _is_key(leaf) else leaf


def like(leaf: Any, numbers: Any) -> Any:
    return jax.random.wrap_key_data(numbers, impl=jax.random.key_impl(leaf)) if _is_key(leaf) else numbers
