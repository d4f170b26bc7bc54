"""JAX's plainest operations on known arrays by numpy, with the same numbers: by JAX each is a program of its own, compiled for milliseconds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from smajax.engine.values import name_of

Params = Mapping[str, Any]


def _broadcast_in_dim(params: Params, one: np.ndarray) -> np.ndarray:
    shape, places = tuple(params["shape"]), tuple(params["broadcast_dimensions"])
    own = [1] * len(shape)
    for axis, place in enumerate(places):
        own[place] = one.shape[axis]
    return np.broadcast_to(one.reshape(own), shape)


def _reshape(params: Params, one: np.ndarray) -> np.ndarray | None:
    return None if params.get("dimensions") is not None else one.reshape(params["new_sizes"])


def _slice(params: Params, one: np.ndarray) -> np.ndarray:
    starts, ends = params["start_indices"], params["limit_indices"]
    strides = params["strides"] or (1,) * one.ndim
    return one[tuple(slice(*of) for of in zip(starts, ends, strides, strict=True))]


def _dynamic_slice(params: Params, one: np.ndarray, *starts: np.ndarray) -> np.ndarray:
    """A part that would reach beyond an end is moved back to it."""
    sizes = params["slice_sizes"]
    first = [min(max(int(at), 0), of - size) for at, of, size in zip(starts, one.shape, sizes, strict=True)]
    return one[tuple(slice(at, at + size) for at, size in zip(first, sizes, strict=True))]


def _convert(params: Params, one: np.ndarray) -> np.ndarray | None:
    new = np.dtype(params["new_dtype"])
    # What becomes of a number that a whole one cannot hold is JAX's to say.
    return None if new.kind in "iu" and one.dtype.kind == "f" else one.astype(new)


def _div(_: Params, one: np.ndarray, other: np.ndarray) -> np.ndarray | None:
    return one / other if one.dtype.kind == "f" else None  # whole numbers are cut towards zero


def _select(_: Params, which: np.ndarray, *cases: np.ndarray) -> np.ndarray | None:
    return np.where(which, cases[1], cases[0]) if which.dtype == bool and len(cases) == 2 else None


def _iota(params: Params) -> np.ndarray:
    shape, dimension = tuple(params["shape"]), params["dimension"]
    along = [1] * len(shape)
    along[dimension] = shape[dimension]
    return np.broadcast_to(np.arange(shape[dimension], dtype=params["dtype"]).reshape(along), shape)


def _integer_pow(params: Params, one: np.ndarray) -> np.ndarray | None:
    return one * one if params["y"] == 2 else None  # of others the order of the products is JAX's own


def _plain(operation: Callable[..., Any]) -> Callable[..., np.ndarray]:
    return lambda _, *given: operation(*given)


# Correctly rounded by the IEEE standard, or no arithmetic at all; numbers below 2.2e-308, which XLA takes for zero, aside. Not exp, log, powers and the like, whose last bit is a library's own.
OPERATIONS: dict[str, Callable[..., np.ndarray | None]] = {
    "add": _plain(np.add),
    "sub": _plain(np.subtract),
    "mul": _plain(np.multiply),
    "div": _div,
    "neg": _plain(np.negative),
    "abs": _plain(np.abs),
    "lt": _plain(np.less),
    "le": _plain(np.less_equal),
    "gt": _plain(np.greater),
    "ge": _plain(np.greater_equal),
    "eq": _plain(np.equal),
    "ne": _plain(np.not_equal),
    "and": _plain(np.bitwise_and),
    "or": _plain(np.bitwise_or),
    "not": _plain(np.bitwise_not),
    "is_finite": _plain(np.isfinite),
    "square": lambda _, one: one * one,
    "integer_pow": _integer_pow,
    "sqrt": _plain(np.sqrt),
    "floor": _plain(np.floor),
    "ceil": _plain(np.ceil),
    "iota": _iota,
    "select_n": _select,
    "convert_element_type": _convert,
    "broadcast_in_dim": _broadcast_in_dim,
    "reshape": _reshape,
    "squeeze": lambda params, one: np.squeeze(one, tuple(params["dimensions"])),
    "transpose": lambda params, one: np.transpose(one, params["permutation"]),
    "stack": lambda params, *given: np.stack(given, params["axis"]),
    "concatenate": lambda params, *given: np.concatenate(given, params["dimension"]),
    "slice": _slice,
    "dynamic_slice": _dynamic_slice,
}


def by_numpy(name: str, params: Params, given: Sequence[np.ndarray]) -> np.ndarray | None:
    """The result of an operation; None for one that is JAX's to do, or whose parameters are not those that are known here."""
    operation = OPERATIONS.get(name)
    if operation is None:
        return None
    try:
        with np.errstate(all="ignore"):
            result = operation(params, *given)
    except (KeyError, TypeError, ValueError, AttributeError):
        return None
    return None if result is None else np.asarray(result)


def computed(equation: Any, given: Sequence[Any]) -> list[Any]:
    """The results of an equation on known arrays: by numpy, where it gives the shape and the kind of number that JAX says, else by JAX."""
    keys = any(name_of(one.aval.dtype).startswith("key<") for one in (*equation.invars, *equation.outvars))
    if not keys:
        out = equation.outvars[0].aval
        plain = by_numpy(equation.primitive.name, equation.params, [np.asarray(one) for one in given])
        if plain is not None and (plain.shape, plain.dtype) == (out.shape, out.dtype):
            return [plain]
    return by_jax(equation.primitive, equation.params, given)


def by_jax(primitive: Any, params: Params, given: Sequence[Any]) -> list[Any]:
    """The results of an operation on known arrays, whatever is traced around it."""
    with jax.ensure_compile_time_eval():
        result = primitive.bind(*given, **params)
    return list(result) if primitive.multiple_results else [result]
