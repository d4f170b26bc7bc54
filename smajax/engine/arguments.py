"""What a compiled program takes: the structure, shapes and kinds of numbers that it was traced for, and the check of each call."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np


def is_array(leaf: Any) -> bool:
    """Whether a leaf of a model is given to the compiled program, and not part of it."""
    return isinstance(leaf, jax.Array | np.ndarray)


class Along(NamedTuple):
    """The names of the numbers of which a run has several, and how many: one for each direction."""

    names: tuple[str, ...] = ()
    number: int = 1


ONE_DIRECTION = Along()


class Signature(NamedTuple):
    """Of a model, all that a traced program depends on: everything but the values of its arrays."""

    tree: Hashable
    leaves: tuple[Hashable, ...]  # shape and dtype of an array, a number with its type, any other leaf itself


def signature(model: Any) -> Signature:
    """The signature of a pytree."""
    leaves, tree = jax.tree.flatten(model)
    return Signature(tree, tuple(map(_kind, leaves)))


def _kind(leaf: Any) -> Hashable:
    if is_array(leaf):
        return leaf.shape, leaf.dtype
    # To Python 1, 1.0, True and numpy's int8(1) are one key; to a traced program they are not.
    return (type(leaf), repr(leaf)) if isinstance(leaf, bool | int | float | complex | np.generic) else leaf


def key_of(function: Hashable, model: Any, names: tuple[str, ...]) -> Hashable:
    """The key of a program in a process: two calls of one key share a trace.

    Raises TypeError where the model holds what cannot be part of a key, and names it.
    """
    weak = tuple(getattr(leaf, "weak_type", False) for leaf in jax.tree.leaves(model) if is_array(leaf))
    key = function, signature(model), weak, names, str(jnp.zeros(()).dtype)
    try:
        hash(key)
    except TypeError as error:
        raise TypeError(
            f"The arguments of a compiled program hold a value that has no hash ({error}); expected arrays, numbers, texts, "
            "tuples and modules. Make a tuple of a list and an array of a table."
        ) from None
    return key


def check_along(names: tuple[str, ...], along: Along) -> None:
    """Raise ValueError for directions of numbers that there are not, or fewer than one."""
    if not isinstance(along.names, tuple) or not set(along.names) <= set(names) or along.number < 1:
        raise ValueError(
            f"Got {along}; expected a tuple of some of the names {list(names)}, and from 1 direction on. Leave it out for one number a run."
        )


def check_arguments(
    made_for: Signature,
    names: tuple[str, ...],
    model: Any,
    own: dict[str, np.ndarray],
    along: Along = ONE_DIRECTION,
) -> None:
    """Raise ValueError where a program made for `made_for` and `names` is called with another model or other arrays.

    `own` are arrays of shape (runs,), at least one run, of one length; those of `along` of shape (runs, `along.number`). Machine code reads memory by the shapes that it
    was made for, so another shape would be read beyond its end.
    """
    if set(own) != set(names):
        raise ValueError(f"Got arrays named {sorted(own)}; the program was made for {sorted(names)}. Give one of each.")
    shapes = {name: np.shape(one) for name, one in own.items()}
    lengths = {shape[:1] for shape in shapes.values()}
    kinds = {name: (along.number,) if name in along.names else () for name in names}
    if len(lengths) > 1 or any(shape[1:] != kinds[name] or shape[:1] < (1,) for name, shape in shapes.items()):
        several = f", of {', '.join(along.names)} shape (runs, {along.number})" if along.names else ""
        raise ValueError(
            f"Got arrays of the shapes {shapes}; expected one number a run, shape (runs,){several}, and the same number of runs for all. "
            "Repeat a number that all runs share with `np.full`."
        )
    got = signature(model)
    if got == made_for:
        return
    for number, (one, other) in enumerate(zip(got.leaves, made_for.leaves, strict=False)):
        if one != other:
            raise ValueError(
                f"Leaf {number} of the model is {_words(one)}; the program was made for {_words(other)}. "
                "Make a program for this model with `program(function, model, names)`."
            )
    raise ValueError(
        "The model has another structure than the one that the program was made for. "
        "Make a program for this model with `program(function, model, names)`."
    )


def checked_threads(threads: int) -> int:
    """A number of threads. Raises ValueError for what is none."""
    if not isinstance(threads, int | np.integer) or threads < 1:
        raise ValueError(f"`threads` is {threads!r}; expected a whole number from 1 on. Leave it out for one a core.")
    return int(threads)


def _words(kind: Hashable) -> str:
    match kind:
        case (type(), str() as number):
            return f"the number {number}"
        case (tuple() as shape, dtype):
            return f"an array of the shape {shape}, {dtype}"
    return repr(kind)
