"""A function of arrays as machine code: compiled in milliseconds where XLA takes seconds, for tests of equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from smajax.engine import program


def by_machine_code(function: Callable[..., Any]) -> Callable[..., Any]:
    """`eqx.filter_jit(function)` without XLA: arrays are arguments of one program, anything else is part of it.

    The results are arrays of numpy. Raises `smajax.engine.Unsupported` for an operation that has no translation.
    """

    def applied(given: tuple[tuple[Any, ...], dict[str, Any]], _: dict[str, Any]) -> Any:
        return function(*given[0], **given[1])

    def run(*args: Any, **kwargs: Any) -> Any:
        given = args, kwargs
        made = program(applied, given, ("number",), alone=True, engine="native")
        return jax.tree.map(lambda leaf: leaf[0], made(given, {"number": np.zeros(1)}, 1))

    return run
