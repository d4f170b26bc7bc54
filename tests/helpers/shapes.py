"""Shapes in signatures held to what a function is given and gives, in one scope: the same name is the same length.

What jaxtyping does with a type checker, without one: annotations that are no shapes (a number may be a Python float, an array one of
NumPy) are mypy's.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, wraps
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import AbstractArray, jaxtyped

Function = TypeVar("Function", bound=Callable[..., Any])


class WrongShape(AssertionError):
    """A value that its annotation does not allow."""


@cache
def hints_of(owner: Any) -> dict[str, Any]:
    """Annotations by name; of a class those of its fields."""
    return get_type_hints(owner)


def is_shape(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, AbstractArray)


def _parts(value: Any, hint: Any) -> Iterator[tuple[str, Any, Any]]:
    """(place, value, annotation) of what a value consists of."""
    if isinstance(value, eqx.Module):
        kind: Any = type(value)
        for name, own in hints_of(kind).items():
            if hasattr(value, name):
                yield f".{name}", getattr(value, name), own
    elif isinstance(value, Mapping) and get_args(hint):
        for key, one in value.items():
            yield f"[{key!r}]", one, get_args(hint)[-1]
    elif isinstance(value, Sequence) and not isinstance(value, str) and get_args(hint):
        for number, one in enumerate(value):
            yield f"[{number}]", one, get_args(hint)[0]


def check(place: str, value: Any, hint: Any) -> None:
    """WrongShape where `value` has not the shape that its annotation gives, or anything in it."""
    if get_origin(hint) in (Union, UnionType):
        shapes = [one for one in get_args(hint) if is_shape(one)]
        number = isinstance(value, jax.Array | np.ndarray)
        if number and shapes and not any(isinstance(jnp.asarray(value), one) for one in shapes):
            raise WrongShape(f"{place} has the shape {np.shape(value)}, expected {hint}")
        if not number:
            for one in get_args(hint):
                if not is_shape(one):
                    check(place, value, one)
        return
    if is_shape(hint):
        if not isinstance(jnp.asarray(value), hint):
            raise WrongShape(
                f"{place} has the shape {np.shape(value)} and the type {np.asarray(value).dtype}, expected {hint}"
            )
        return
    for name, one, own in _parts(value, hint):
        check(place + name, one, own)


def checked(function: Function) -> Function:
    """The function, held to the shapes in its signature."""
    signature, hints = inspect.signature(function), hints_of(function)

    @wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        with jaxtyped("context"):
            for name, value in signature.bind(*args, **kwargs).arguments.items():
                check(f"`{name}`", value, hints[name])
            result = function(*args, **kwargs)
            check("the result", result, hints["return"])
        return result

    return called  # type: ignore[return-value]
