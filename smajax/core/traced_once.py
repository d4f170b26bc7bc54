"""Functions that JAX traces once for arguments of one kind, however often and in however many programs they are used."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from typing import Any, TypeVar, cast

import jax
import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray | np.generic)


def traced_once(function: Function) -> Function:
    """`function` of pytrees, pure, for use within larger programs: where it is used again its equations are copied.

    Tracing a model's equations takes Python ten times as long as copying what came of it, and a step holds them a dozen times.
    The kind of the arguments is their structure, the shapes and types of their arrays, and the values of all else, which have
    to be hashable.
    """

    @partial(jax.jit, static_argnums=(1, 2), inline=True)
    def traced(arrays: list[jax.Array], rest: tuple[tuple[type, Any], ...], tree: Any) -> Any:
        leaves, given = list(arrays), []
        for kind, value in rest:
            given.append(leaves.pop(0) if kind is jax.Array else value)
        return function(*jax.tree.unflatten(tree, given))

    @wraps(function)
    def called(*arguments: Any) -> Any:
        leaves, tree = jax.tree.flatten(arguments)
        # To Python 1, 1.0 and True are one key.
        rest = tuple((jax.Array, None) if _is_array(leaf) else (type(leaf), leaf) for leaf in leaves)
        return traced([leaf for leaf in leaves if _is_array(leaf)], rest, tree)

    return cast(Function, called)
