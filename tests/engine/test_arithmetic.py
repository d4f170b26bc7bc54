"""Arithmetic and functions by machine code: XLA's numbers, also for NaN, infinities and the ends of their ranges."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from tests.helpers.engine_results import Function, by_machine_code, by_xla

Numbers = tuple[Any, ...]
ODD = [0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -2.5, 1e-300, -1e300, 1e308, np.inf, -np.inf, np.nan, 3.0, 1e-9, 7.1]
ELEMENTWISE: dict[str, Function] = {
    "sum": lambda a, b: a + b,
    "difference": lambda a, b: a - b,
    "product": lambda a, b: a * b,
    "larger": jnp.maximum,
    "smaller": jnp.minimum,
    "larger than a constant": lambda a, b: jnp.maximum(a, 0.3) + jnp.minimum(0.2, b),
    "sign": lambda a, b: jnp.sign(a),
    "size": lambda a, b: jnp.abs(a) - jnp.abs(b),
    "below": lambda a, b: a < b,
    "not equal": lambda a, b: a != b,
    "at least": lambda a, b: a >= b,
    "finite": lambda a, b: jnp.isfinite(a) & ~jnp.isnan(b),
    "floor and ceiling": lambda a, b: jnp.floor(a) + jnp.ceil(b),
    "round": lambda a, b: jnp.round(a),
    "chosen": lambda a, b: jnp.where(a > b, a, b),
    "clipped": lambda a, b: jnp.clip(a, -1.0, 2.0),
    "power": lambda a, b: a**3 + b**2,
    "whole number": lambda a, b: jnp.clip(a, -50.0, 50.0).astype(int) % 3,
    "shifted": lambda a, b: (
        (jnp.clip(a, 0.0, 9.0).astype("uint32") << 3) >> jnp.clip(b, 0.0, 40.0).astype("uint32")
    ).astype(float),
    "shifted with its sign": lambda a, b: (jnp.clip(a, -9.0, 9.0).astype(int) >> jnp.clip(b, 0, 99).astype(int)) * 1.0,
    "bits": lambda a, b: lax.bitcast_convert_type(a, jnp.uint64) >> jnp.uint64(12),
    "truth as number": lambda a, b: 1.0 * (a > 0.0) + (b > 0.0),
}


@pytest.mark.parametrize("name", ELEMENTWISE)
def test_arithmetic_equals_xla_to_the_bit_also_for_nan_and_infinity(name):
    a, b = (np.ravel(one) for one in np.meshgrid(ODD, ODD))
    found, wanted = by_machine_code(ELEMENTWISE[name], a, b), by_xla(ELEMENTWISE[name], a, b)
    assert found.dtype == wanted.dtype or wanted.dtype == bool
    # A NaN is equal to a NaN here; XLA takes numbers below the normal ones for zero.
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=np.finfo(float).tiny)


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_division_by_anything_is_right_to_two_roundings(wide, dtype):
    if wide and not _wide():
        pytest.skip("this processor has no AVX-512")
    with np.errstate(all="ignore"):
        a, b = (np.ravel(one).astype(dtype) for one in np.meshgrid(ODD, [*ODD, 1 / 3, 1e5, 123.456]))
        wanted = a / b
        inverse = np.asarray(1.0, dtype) / b
    found = by_machine_code(lambda a, b: a / b, a, b, lanes=64 // a.itemsize, wide=wide)
    ordinary = np.isfinite(wanted) & np.isfinite(inverse) & (np.abs(inverse) > np.finfo(dtype).tiny)
    ordinary &= (np.abs(wanted) > np.finfo(dtype).tiny) | (a == 0.0)
    np.testing.assert_allclose(found[ordinary], wanted[ordinary], rtol=4 * np.finfo(dtype).eps)
    by_zero = (b == 0.0) & (a != 0.0) & np.isfinite(a)
    np.testing.assert_array_equal(np.abs(found[by_zero]), np.inf)
    assert np.isnan(found[np.isnan(a) | np.isnan(b)]).all()
    assert (found[np.isinf(b) & np.isfinite(a)] == 0.0).all()


def _wide() -> bool:
    from smajax.engine.kernel import has_wide_vectors

    return has_wide_vectors()


FUNCTIONS: dict[str, Function] = {
    **{one.__name__: one for one in (jnp.exp, jnp.log, jnp.sqrt, jnp.tanh, jnp.sin)},
    "slope of arccos": lambda x: jax.grad(jnp.arccos)(0.33 * x),
    "slope of tanh": lambda x: jax.grad(jnp.tanh)(0.3 * x),
}


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
def test_functions_agree_with_xla(function):
    x = np.linspace(0.01, 3.0, 16)
    np.testing.assert_allclose(by_machine_code(function, x), by_xla(function, x), rtol=1e-14)


# XLA's own logarithm is off by 2e-14 in older versions: what is compared with is exact.
EXACT = {"expm1": (jnp.expm1, np.expm1), "log1p": (jnp.log1p, np.log1p), "erf_inv": (lax.erf_inv, None)}


@pytest.mark.parametrize(("function", "exact"), EXACT.values(), ids=EXACT)
def test_functions_agree_with_exact_values_near_zero_and_at_their_ends(function, exact):
    """Where the plain formula would leave no digit, and where it would be nothing times infinity."""
    ends = [-1.0, 0.0, 1e-300, -1e-12, 1e-5, np.nan]
    ends += [1.0, 1.0 - 1e-15] if function is lax.erf_inv else [np.inf, 709.5, 1e300]
    ends += [-np.inf, -700.0, -1e4] if function is jnp.expm1 else []
    x = np.concatenate([np.linspace(-0.999, 0.999, 500), ends])
    with np.errstate(all="ignore"):
        wanted = by_xla(function, x) if exact is None else exact(x)
    np.testing.assert_allclose(by_machine_code(function, x), wanted, rtol=1e-14)


@pytest.mark.parametrize("count", [5, 300])
def test_random_numbers_equal_those_of_jax(count):
    """Numbers drawn inside of the program, from a key that is the run's own; few in registers, many in memory."""

    def drawn(number):
        key, _ = jax.random.split(jax.random.fold_in(jax.random.key(3), number.astype(int)))
        return jax.random.normal(key, (count,)) + jax.random.uniform(key, (count,))

    numbers = np.arange(21.0)
    np.testing.assert_allclose(by_machine_code(drawn, numbers), by_xla(drawn, numbers), rtol=0.0, atol=1e-14)


def test_the_triangle_of_a_small_matrix_equals_that_of_jax_and_is_no_number_where_there_is_none() -> None:
    """As in the unscented filter, of a covariance of four states."""

    def triangle(share: jax.Array) -> jax.Array:
        return jnp.linalg.cholesky((1.0 - share) * jnp.eye(4) + share * jnp.ones((4, 4)))

    shares = np.array([-0.2, 0.0, 0.5, 0.99, 1.5])
    found, wanted = by_machine_code(triangle, shares), by_xla(triangle, shares)
    np.testing.assert_allclose(found[:4], wanted[:4], rtol=1e-13, atol=1e-15)
    assert np.isnan(found[4]).any()
    assert np.isnan(wanted[4]).any()
