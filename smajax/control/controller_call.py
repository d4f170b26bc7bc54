"""A call of a controller in a loop, which JAX traces, and what is said of one that cannot be called there."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.model.types import Scalar

ASKED_FOR_NUMBERS = (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError)


def check_is_controller(controller: Any) -> None:
    """Raise TypeError for what is no controller, such as a function."""
    if not isinstance(controller, AbstractController):
        kind = "the class" if isinstance(controller, type) else f"{type(controller).__name__}"
        name = getattr(controller, "__name__", "")
        raise TypeError(
            f"got {kind}{f' `{name}`' if name else ''}, expected a controller: an object of a class of `AbstractController` "
            "(`smajax.control.controllers.base`), which has `start` and `step`, or for `loop_around` the name of one of smajax."
        )


def commanded(
    controller: AbstractController, memory: Any, measured: MeasuredState, wanted: Reference, period: Scalar
) -> tuple[Any, Scalar]:
    """(memory, command) of one call.

    Raises TypeError for a controller whose `step` asks for numbers where there are none yet, as `if` and functions of numpy do, and for an answer
    that is no pair of a memory and one number.
    """
    name = type(controller).__name__
    try:
        answer: Any = controller.step(memory, measured, wanted, period)
    except ASKED_FOR_NUMBERS as error:
        raise TypeError(
            f"`{name}.step` asks for a number where there is none yet: JAX calls it once, with names in the place of numbers, and makes a program "
            "of it for all samples. In the place of `if` use `jnp.where(condition, this, that)`, and functions of `jax.numpy` in the place of "
            f"those of numpy, `math` and `float`. JAX says: {str(error).splitlines()[0]}"
        ) from error
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise TypeError(f"`{name}.step` gives {_shown(answer)}, expected (memory, command).")
    after, command = answer[0], answer[1]
    forms = [(jax.tree.structure(one), [jnp.shape(leaf) for leaf in jax.tree.leaves(one)]) for one in (memory, after)]
    if forms[0] != forms[1]:
        raise TypeError(
            f"the memory that `{name}.step` gives has another form than that of `start`: {_form(after)}, expected {_form(memory)}."
        )
    if isinstance(command, tuple | list | dict | str) or command is None or jnp.shape(command) != ():
        raise TypeError(f"the command of `{name}.step` is {_shown(command)}, expected one number.")
    return after, jnp.asarray(command, dtype=float)


def _form(memory: Any) -> str:
    """Structure, with the shape of each array."""
    return str(jax.tree.map(jnp.shape, memory))


def _shown(value: Any) -> str:
    if isinstance(value, jax.Array):
        return f"an array of shape {value.shape}"
    return f"a tuple of {len(value)}" if isinstance(value, tuple) else f"`{type(value).__name__}`"
