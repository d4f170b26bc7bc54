"""How often a `while` runs at most, where its test says so: a counter that goes up by one and has to stay below a number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax.extend as jex
import numpy as np

from smajax.engine.jax_versions import TABLE, opened, parameters_of


def _makers(jaxpr: Any) -> dict[Any, Any]:
    return {variable: equation for equation in jaxpr.eqns for variable in equation.outvars}


def _known(atom: Any) -> float | None:
    return float(np.asarray(atom.val)) if isinstance(atom, jex.core.Literal) and np.ndim(atom.val) == 0 else None


def _limits(jaxpr: Any) -> dict[Any, float]:
    """Arguments of a test -> the number that each has to stay below for it to hold."""
    makers, found = _makers(jaxpr), {}
    asked = [jaxpr.outvars[0]]
    while asked:
        equation = makers.get(asked.pop())
        if equation is None:
            continue
        if equation.primitive.name in ("and", "convert_element_type"):
            asked += [one for one in equation.invars if not isinstance(one, jex.core.Literal)]
        elif equation.primitive.name in ("lt", "le"):
            counter, most = equation.invars[0], _known(equation.invars[1])
            if most is not None and not isinstance(counter, jex.core.Literal):
                found[counter] = most + (1.0 if equation.primitive.name == "le" else 0.0)
    return found


def _inside(jaxpr: Any, place: int) -> tuple[Any, int]:
    """The innermost program that makes the result at `place`, through calls."""
    equation = _makers(jaxpr).get(jaxpr.outvars[place])
    calls = {name for name, own in TABLE.items() if "program" in own and name != "scan"}
    if equation is not None and equation.primitive.name in calls and len(jaxpr.eqns) == 1:
        return _inside(
            opened(parameters_of(equation)["program"])[0], list(equation.outvars).index(jaxpr.outvars[place])
        )
    return jaxpr, place


def _counts(jaxpr: Any, argument: int, place: int) -> bool:
    """Whether the result at `place` is the argument and one more."""
    equation = _makers(jaxpr).get(jaxpr.outvars[place])
    if equation is None or equation.primitive.name != "add":
        return False
    left, right = equation.invars
    return left is jaxpr.invars[argument] and _known(right) == 1.0


def most_rounds(test: Any, body: Any, fixed: Sequence[Any], start: Sequence[Any]) -> int | None:
    """Of a while loop; None where its test does not say so. `fixed`: the test's constants; `start`: what is carried."""
    test_jaxpr, body_jaxpr = _inside(opened(test)[0], 0)[0], opened(body)[0]
    limits, best = _limits(test_jaxpr), None
    for place, value in enumerate(start):
        variable = test_jaxpr.invars[len(fixed) + place]
        argument = len(body_jaxpr.invars) - len(start) + place
        if (
            variable not in limits
            or value.dtype == object
            or np.ndim(value)
            or not _counts(body_jaxpr, argument, place)
        ):
            continue
        rounds = max(int(np.ceil(limits[variable] - float(value))), 0)
        best = rounds if best is None else min(best, rounds)
    return best
