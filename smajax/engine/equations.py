"""The equations of a traced program, read once: one that many places call is translated in each, with other arguments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import jax.extend as jex
import numpy as np

from smajax.engine.arithmetic import ELEMENTWISE, Operation, exact_quotient
from smajax.engine.jax_versions import kind_of, parameters_of, refuse_unread
from smajax.engine.text import Array

CUTTING = ("floor", "ceil", "round", "trunc", "fix", "floor_divide")
Read = tuple[Any, np.ndarray | None]  # a variable, or None and the array that is known


@dataclass(slots=True)
class Step:
    """An equation: what it is called here, and its parameters by our names.

    operation, out: of arithmetic, else None.
    """

    equation: Any
    name: str
    params: dict[str, Any]
    reads: tuple[Read, ...]
    operation: Operation | None
    out: Array | None
    checked: bool = False

    def check(self) -> None:
        """Raise Unsupported for arithmetic with a parameter of a later release."""
        if not self.checked:
            refuse_unread(self.equation)
            self.checked = True


_array = cache(Array)


def array_of(aval: Any) -> Array:
    return _array(*kind_of(aval))


def note(error: Exception, equation: Any) -> None:
    """Say in an error where it was, of the innermost program alone."""
    if not hasattr(error, "__notes__"):
        error.add_note(f"while the operation `{equation.primitive.name}` was translated")


def read_of(atom: Any) -> Read:
    if isinstance(atom, jex.core.Literal):
        return None, np.asarray(atom.val, dtype=array_of(atom.aval).dtype)
    return atom, None


def _cuts(equation: Any) -> bool:
    """Whether it cuts its argument to a whole number: a quotient must not be a bit below one then."""
    name = equation.primitive.name
    if name in ("jit", "pjit"):
        name = str(parameters_of(equation)["name"])
    to_whole = name == "convert_element_type" and "int" in str(parameters_of(equation)["new_dtype"])
    return to_whole or name in CUTTING


def _step(equation: Any, to_the_bit: set[int]) -> Step:
    name, out = equation.primitive.name, None
    operation = ELEMENTWISE.get(name)
    if operation is not None:
        out = array_of(equation.outvars[0].aval)
        if name == "div" and id(equation.outvars[0]) in to_the_bit and out.dtype.startswith("float"):
            operation = exact_quotient
    reads = tuple(map(read_of, equation.invars))
    return Step(equation, name, parameters_of(equation), reads, operation, out)


def steps_of(jaxpr: Any) -> tuple[Step, ...]:
    """Raises Unsupported for parameters that cannot be read."""
    to_the_bit = {id(one) for equation in jaxpr.eqns if _cuts(equation) for one in equation.invars}
    steps = []
    for equation in jaxpr.eqns:
        try:
            steps.append(_step(equation, to_the_bit))
        except Exception as error:
            note(error, equation)
            raise
    return tuple(steps)
