"""Loops of different lengths in the lanes of a vector: the numbers of the whole program."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from tests.engine.test_arithmetic import Numbers
from tests.helpers.engine_results import by_machine_code, by_xla


def _busy(a: jax.Array) -> jax.Array:
    """More than one phase holds, and truth values that go from the first to the last; whole numbers all the way."""
    x, y, asked = a, 3.0 - a, []
    for k in range(120):
        asked.append(x > y)
        x, y = jnp.where(x > y, x - 2.0 * y + k, y), jnp.where(x > 50.0, x - 50.0, x + y - k)
    return x + y + sum(jnp.where(one, float(k), 0.5) for k, one in enumerate(asked))


def _crosswise(a: jax.Array) -> jax.Array:
    """Loops in a loop whose numbers change places from round to round, and one that is asked for after it was handed on."""

    def inner(carry: Numbers, x: jax.Array) -> tuple[Numbers, jax.Array]:
        p, q, r = carry
        return (q, r + x, p), p - r

    def outer(carry: Numbers, x: jax.Array) -> tuple[Numbers, None]:
        p, q, kept = carry
        (new_p, new_q, r), seen = lax.scan(inner, (p, q, a), jnp.arange(3.0) + x)
        new_p, r, new_q = lax.fori_loop(0, 2, lambda _, now: (now[1], now[2], now[0] + p), (new_p, r, new_q))
        return (new_q, new_p, kept + r + 2.0 * q + seen[1]), None

    (p, q, kept), _ = lax.scan(outer, (a, 2.0 * a, 0.0 * a), jnp.arange(5.0))
    return p + 10.0 * q + 100.0 * kept


def _late(a: jax.Array) -> jax.Array:
    """What a loop carries is asked for long after its next value is known."""

    def body(carry: Numbers, x: jax.Array) -> tuple[Numbers, None]:
        old, total = carry
        return (2.0 * old - x, total + _busy(x + a) * old), None

    return lax.scan(body, (a, 0.0 * a), jnp.arange(6.0))[0][1]


def _uneven(a: jax.Array) -> jax.Array:
    """Rounds within rounds, from none to many, by the member: what is done stays while others go on."""

    def smaller(at: Numbers) -> Numbers:
        left, total = at
        _, steps = lax.while_loop(
            lambda now: now[0] > 0.0, lambda now: (now[0] - 7.0, now[1] + 1.0), (left, total * 0.0)
        )
        return left - 3.0, total + steps + left

    return lax.while_loop(lambda at: at[0] > 2.0, smaller, (a, 0.5 * a))[1]


def _begun_again(a: jax.Array) -> jax.Array:
    """The innermost loop begins with what the outermost carries in every round of the one between."""

    def between(p: jax.Array) -> Callable[[int, jax.Array], jax.Array]:
        return lambda _, b: b + lax.fori_loop(0, 3, lambda _, c: 2.0 * c + b, p)

    return lax.fori_loop(0, 2, lambda _, p: lax.fori_loop(0, 4, between(p), a), a)


def _small(a: jax.Array) -> jax.Array:
    """Truth values and whole numbers of one byte that live across phases beside each other."""

    def moved(x: jax.Array, many: int) -> jax.Array:
        for k in range(many):
            x = jnp.where(x > 50.0, x - 50.0, x + k)
        return x

    asked = [a > 0.5 * k for k in range(4)]
    x, small = moved(a, 80), []
    for one in asked:
        x = jnp.where(one, x + 1.0, x)
        small.append(x.astype(jnp.int8))
        x = moved(x, 3)
    x = moved(x, 80)
    return x + sum(one.astype(float) for one in small)


@pytest.mark.parametrize(
    ("vectors", "mask"),
    [
        pytest.param(1, "i1", marks=pytest.mark.slow),
        (3, "i1"),
        pytest.param(8, "i1", marks=pytest.mark.slow),
        pytest.param(8, "i64", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize(
    "function", [_busy, _crosswise, _late, _uneven, _begun_again, _small], ids=lambda one: one.__name__
)
def test_phases_over_any_number_of_vectors_equal_xla(function, vectors, mask):
    a = np.arange(150.0) % 41.0 - 3.0
    np.testing.assert_array_equal(by_machine_code(function, a, vectors=vectors, mask=mask), by_xla(function, a))


@pytest.mark.parametrize("vectors", [1, 3])
@pytest.mark.parametrize("function", [_busy, _crosswise, _uneven], ids=lambda one: one.__name__)
def test_a_program_that_is_compiled_quickly_gives_the_same_numbers(
    function: Callable[[jax.Array], jax.Array], vectors: int, optimised: None
) -> None:
    """With LLVM's levels as users have them."""
    a = np.arange(150.0) % 41.0 - 3.0
    quick = by_machine_code(function, a, vectors=vectors, quickly=True)
    np.testing.assert_array_equal(quick, by_machine_code(function, a, vectors=vectors))
