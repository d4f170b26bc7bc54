"""JAX's plainest operations by numpy: the same bits as JAX gives, or left to it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from smajax.engine.by_numpy import OPERATIONS, by_numpy

VALUES = np.asarray([0.0, -0.0, 1.5, -2.25, 1e308, -3.0, np.inf, -np.inf, np.nan, 0.1])
OTHERS = np.asarray([3.0, 0.0, -7.1, 1e-9, 10.0, 2.0, 1.0, np.nan, 0.5, 0.3])
TABLE = np.arange(24.0).reshape(2, 3, 4)
WHOLE = np.asarray([3, -4, 0, 7], dtype="int32")
TRUTHS = np.asarray([True, False, True, False])

FUNCTIONS: dict[str, tuple[Callable[..., Any], tuple[np.ndarray, ...]]] = {
    **{
        name: (getattr(lax, name), (VALUES, OTHERS))
        for name in ("add", "sub", "mul", "div", "lt", "le", "gt", "ge", "eq", "ne")
    },
    **{name: (getattr(lax, name), (VALUES,)) for name in ("neg", "abs", "is_finite", "square", "floor", "ceil")},
    "sqrt": (lax.sqrt, (np.concatenate([VALUES, OTHERS, np.abs(TABLE.ravel()) / 7.0]),)),
    "integer_pow": (lambda x: lax.integer_pow(x, 2), (np.concatenate([VALUES, OTHERS]),)),
    "iota": (lambda: lax.broadcasted_iota("int32", (3, 4), 1), ()),
    "stack": (lambda x, y: jnp.stack([x, y], 1), (TABLE, TABLE + 1.0)),
    "and": (lax.bitwise_and, (TRUTHS, TRUTHS[::-1].copy())),
    "or": (lax.bitwise_or, (TRUTHS, TRUTHS[::-1].copy())),
    "not": (lax.bitwise_not, (TRUTHS,)),
    "select_n": (lax.select_n, (TRUTHS, VALUES[:4], OTHERS[:4])),
    "convert_element_type": (lambda x: lax.convert_element_type(x, jnp.float64), (WHOLE,)),
    "broadcast_in_dim": (lambda x: lax.broadcast_in_dim(x, (4, 2, 3), (1, 2)), (TABLE[:, :, 0],)),
    "reshape": (lambda x: lax.reshape(x, (4, 6)), (TABLE,)),
    "squeeze": (lambda x: lax.squeeze(x, (1,)), (TABLE[:, :1],)),
    "transpose": (lambda x: lax.transpose(x, (2, 0, 1)), (TABLE,)),
    "concatenate": (lambda x, y: lax.concatenate([x, y], 1), (TABLE, TABLE[:, :2])),
    "slice": (lambda x: lax.slice(x, (0, 1, 0), (2, 3, 4), (1, 1, 2)), (TABLE,)),
    "dynamic_slice": (lambda x, i: lax.dynamic_slice(x, (i[0], i[1], i[2]), (1, 2, 3)), (TABLE, WHOLE)),
}


def _each(
    function: Callable[..., Any], given: tuple[np.ndarray, ...]
) -> list[tuple[str, np.ndarray | None, np.ndarray]]:
    """(operation, by numpy, by JAX) of the equations of a function on known arrays."""
    jaxpr = jax.make_jaxpr(function)(*given)
    jaxpr_in = [*jaxpr.jaxpr.constvars, *jaxpr.jaxpr.invars]
    names: dict[Any, np.ndarray] = dict(zip(jaxpr_in, [*map(np.asarray, jaxpr.consts), *given], strict=True))
    found = []
    for equation in jaxpr.jaxpr.eqns:
        arguments = [np.asarray(one.val) if hasattr(one, "val") else names[one] for one in equation.invars]
        result = np.asarray(equation.primitive.bind(*arguments, **equation.params))
        names[equation.outvars[0]] = result
        found.append((equation.primitive.name, by_numpy(equation.primitive.name, equation.params, arguments), result))
    return found


@pytest.mark.parametrize("name", OPERATIONS)
def test_an_operation_gives_the_bits_of_jax(name: str) -> None:
    checked = {one: (ours, true) for one, ours, true in _each(*FUNCTIONS[name])}
    if name == "stack" and name not in checked:
        pytest.skip("this JAX joins arrays by `concatenate`")
    ours, true = checked[name]
    assert ours is not None
    assert (ours.shape, ours.dtype) == (true.shape, true.dtype)
    numbers = true.dtype.kind == "f"
    known = ~np.isnan(true) if numbers else np.ones(true.shape, bool)
    np.testing.assert_array_equal(np.isnan(ours), ~known) if numbers else None
    assert ours[known].tobytes() == true[known].tobytes()


def test_what_is_not_plain_is_left_to_jax() -> None:
    left = [
        _each(lambda x: lax.convert_element_type(x, jnp.int32), (VALUES,)),
        _each(lax.div, (WHOLE, WHOLE + 10)),
        _each(lax.exp, (VALUES,)),
        _each(lambda x: lax.integer_pow(x, 3), (VALUES,)),
        _each(
            lambda x: lax.select_n(x, VALUES[:4], OTHERS[:4], VALUES[4:8]), (np.asarray([0, 1, 2, 0], dtype="int32"),)
        ),
    ]
    assert [found[0][1] for found in left] == [None] * len(left)
