"""A call of a controller in a loop, which JAX traces, and what is said of one that cannot be called there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.controllers.base import AbstractController
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.model.types import Scalar

ASKED_FOR_NUMBERS = (
    jax.errors.ConcretizationTypeError,
    jax.errors.TracerArrayConversionError,
    jax.errors.TracerIntegerConversionError,
    jax.errors.NonConcreteBooleanIndexError,
)


def check_is_controller(controller: Any) -> None:
    """Raise TypeError for what is no controller, such as a function."""
    if not isinstance(controller, AbstractController):
        kind = "the class" if isinstance(controller, type) else f"{type(controller).__name__}"
        name = getattr(controller, "__name__", "")
        raise TypeError(
            f"got {kind}{f' `{name}`' if name else ''}, expected a controller: an object of a class of `AbstractController` "
            "(`smajax.control.controllers.base`), which has `start` and `step`, or for `loop_around` the name of one of smajax."
        )


def begun(controller: AbstractController, measured: MeasuredState, wanted: Reference) -> Any:
    """The memory before the first call. Raises TypeError for a `start` that JAX cannot trace, and for a memory that is no pytree of numbers."""
    with _traced(controller, "start"):
        memory = controller.start(measured, wanted)
    for leaf in jax.tree.leaves(memory):
        if not isinstance(leaf, jax.Array | np.ndarray | np.generic | float | int):
            raise TypeError(
                f"the memory that `{type(controller).__name__}.start` gives has {_shown(leaf)} in it, expected numbers and arrays, also in tuples, "
                "dictionaries and classes of `equinox.Module`."
            )
    return memory


def commanded(
    controller: AbstractController, memory: Any, measured: MeasuredState, wanted: Reference, period: Scalar
) -> tuple[Any, Scalar]:
    """(memory, command) of one call.

    Raises TypeError for a controller whose `step` asks for numbers where there are none yet, as `if` and functions of numpy do, for an answer
    that is no pair of a memory and one number, and for a memory of another form, or of numbers of another kind, than it was given.
    """
    name = type(controller).__name__
    with _traced(controller, "step"):
        answer: Any = controller.step(memory, measured, wanted, period)
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise TypeError(f"`{name}.step` gives {_shown(answer)}, expected (memory, command).")
    after, command = answer[0], answer[1]
    forms = [(jax.tree.structure(one), [jnp.shape(leaf) for leaf in jax.tree.leaves(one)]) for one in (memory, after)]
    if forms[0] != forms[1]:
        raise TypeError(
            f"the memory that `{name}.step` gives has another form than that of `start`: {_form(after)}, expected {_form(memory)}."
        )
    is_number = isinstance(command, jax.Array | np.ndarray | np.generic | float | int) and jnp.shape(command) == ()
    if not is_number or jnp.iscomplexobj(command):
        raise TypeError(f"the command of `{name}.step` is {_shown(command)}, expected one number.")
    return jax.tree.map(partial(_alike, name), memory, after), jnp.asarray(command, dtype=float)


@contextmanager
def _traced(controller: AbstractController, method: str) -> Iterator[None]:
    try:
        yield
    except ASKED_FOR_NUMBERS as error:
        raise TypeError(
            f"`{type(controller).__name__}.{method}` asks for a number where there is none yet: JAX calls it once, with names in the place of numbers, "
            "and makes a program of it for all samples. In the place of `if` use `jnp.where(condition, this, that)`, and functions of `jax.numpy` "
            f"in the place of those of numpy, `math` and `float`. JAX says: {str(error).splitlines()[0]}"
        ) from error


def _alike(name: str, before: Any, after: Any) -> Any:
    """A number of the memory in the precision that it had, where nothing but precision is lost."""
    kinds = jnp.asarray(before).dtype, jnp.asarray(after).dtype
    if kinds[0] == kinds[1]:
        return after
    both_real = all(jnp.issubdtype(kind, jnp.floating) for kind in kinds)
    if both_real or jnp.promote_types(*kinds) == kinds[0]:
        return jnp.asarray(after, dtype=kinds[0])
    raise TypeError(
        f"a number of the memory is {kinds[1]} after `{name}.step` and {kinds[0]} before: let `start` give it as {kinds[1]}, such as `0.0` in the "
        "place of `0` or `False`."
    )


def _form(memory: Any) -> str:
    """Structure, with the shape of each array."""
    return str(jax.tree.map(jnp.shape, memory))


def _shown(value: Any) -> str:
    if isinstance(value, jax.Array | np.ndarray):
        return f"an array of {value.dtype} of shape {value.shape}"
    return f"a tuple of {len(value)}" if isinstance(value, tuple) else f"`{type(value).__name__}`"
