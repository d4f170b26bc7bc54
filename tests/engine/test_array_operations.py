"""Loops, tables and arrays by machine code: XLA's numbers, or the name of what has no translation."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from smajax.core.checkpointed_scan import checkpointed_scan, recomputed, solved
from smajax.engine import Unsupported
from tests.helpers.engine_results import Function, by_machine_code, by_xla


def _newton(a: jax.Array) -> jax.Array:
    """The square root, by as many iterations as each member needs."""

    def going(at: tuple[jax.Array, jax.Array]) -> jax.Array:
        return jnp.abs(at[0] ** 2 - a) > 1e-12 * a

    def body(at: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        return 0.5 * (at[0] + a / at[0]), at[1] + 1

    root, count = lax.while_loop(going, body, (a, jnp.zeros((), int)))
    return root + 1000.0 * count


def _nested(a: jax.Array) -> jax.Array:
    """Loops in loops, of which each keeps what the inner one gave; the second goes backwards."""

    def inner(carry: jax.Array, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        carry = 0.9 * carry + x
        return carry, carry * a

    def outer(carry: jax.Array, row: jax.Array) -> tuple[jax.Array, jax.Array]:
        carry, kept = lax.scan(inner, carry, row)
        return carry, jnp.concatenate([kept[1:], carry[None]])

    end, kept = lax.scan(outer, a, jnp.arange(300.0).reshape(3, 100) / 300.0)
    later, back = lax.scan(lambda total, row: (total + row, total), jnp.zeros(100), kept[:2], reverse=True)
    return end + later.sum() + back[0, 7]


def _long(a: jax.Array) -> jax.Array:
    end, kept = lax.scan(lambda c, x: (jnp.sin(c) + x, c * a), a, jnp.arange(200.0) / 100.0)
    return jnp.append(end, kept)


def _looked_up(a: jax.Array) -> jax.Array:
    table = jnp.arange(100.0) ** 2
    index = jnp.clip(a * 10.0, -20.0, 120.0).astype(int)
    return table[index] + lax.switch(jnp.clip(index, 0, 2), [lambda: a, lambda: 2.0 * a, lambda: -a])


def _backwards(a: jax.Array) -> jax.Array:
    """A derivative through a long loop in segments, of a series that is too large for registers and was shifted before."""

    def body(carry: tuple[jax.Array, jax.Array], x: jax.Array) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        kept = solved(jnp.sin(carry[0] * x))
        one, other = jnp.stack([kept + carry[1], kept * a])
        return (0.5 * one, jnp.cos(other)), kept * one

    def cost(a: jax.Array) -> jax.Array:
        series = a * jnp.arange(200.0) / 200.0
        shifted = jnp.concatenate([jnp.full(3, a), series[:-3]])
        (end, _), kept = checkpointed_scan(recomputed(body), (a, 0.1 * a), shifted - series, 200)
        return end + (kept * series).sum()

    return jax.grad(cost)(a)


def _every_seventh(a: jax.Array) -> jax.Array:
    """Of a long series, and of one that all share."""
    kept = lax.scan(lambda c, x: (0.5 * c + x, c * a), a, jnp.arange(600.0) / 100.0)[1]
    return kept[3:590:7] + jnp.arange(1200.0)[::2][3:590:7] + kept.reshape(300, 2)[::40].sum()


def _gathered(a: jax.Array) -> jax.Array:
    """Many numbers taken out of a long series at once: evenly spaced, out of order, each twice, and where each run says."""
    kept = lax.scan(lambda c, x: (0.5 * c + x, c * a), a, jnp.arange(200.0) / 100.0)[1]
    whole = (jnp.floor(a).astype(int) + jnp.arange(100)) % 200
    few = (jnp.floor(a).astype(int) + jnp.arange(3)) % 200
    small = jnp.stack([a, 2.0 * a, -a])

    def at(x: jax.Array, places: jax.Array | np.ndarray, mode: str = "clip") -> jax.Array:
        return x.at[places].get(mode=mode)

    evenly = at(kept, np.arange(100) * 2, "promise_in_bounds") + at(kept, np.arange(100))
    uneven = at(kept, np.arange(100) ** 2 % 200) + at(kept, np.repeat(np.arange(50), 2), "fill") + at(small, whole)
    rows = [at(kept.reshape(100, 2), np.array([7, 3, 3])), at(kept.reshape(2, 100), np.array([1, 0, 1]))]
    one_each = [at(kept, few), at(small, few), at(kept, np.array([9, 4]))]
    return jnp.concatenate([evenly + uneven + at(kept, whole), *(one.ravel() for one in rows), *one_each])


def _repeated(a: jax.Array) -> jax.Array:
    """A long series along every axis of a larger one, and what all share."""
    kept = lax.scan(lambda c, x: (0.5 * c + x, c * a), a, jnp.arange(100.0))[1]
    rows = jnp.broadcast_to(kept[:, None], (100, 3)) * jnp.broadcast_to(jnp.stack([a, 2.0 * a, -a]), (100, 3))
    return (rows * jnp.broadcast_to(jnp.arange(100.0)[:, None], (100, 3))).reshape(-1)[::7] + jnp.sinc(a)


def _placed(a: jax.Array) -> jax.Array:
    """Numbers put in their places of an array; what lies beyond its end is dropped."""
    return jnp.zeros((3, 3)).at[0, 1].set(a).at[1, :2].set(2.0 * a).at[5, 5].set(-a).at[2].set(a * jnp.arange(3.0))


def _folded(a: jax.Array) -> jax.Array:
    """Of more numbers than there are registers: their sum, the largest, and whether all of them are below another."""
    kept = lax.scan(lambda c, x: (jnp.sin(c) + x, c * a), a, jnp.arange(200.0) / 100.0)[1]
    return kept.sum() + 1e3 * kept.max() + 1e6 * (kept.reshape(20, 10) < 2.0 * a).all()


@pytest.mark.parametrize(
    "function",
    [_newton, _long, _looked_up, _backwards, _every_seventh, _gathered, _repeated, _placed, _folded],
    ids=lambda one: one.__name__,
)
def test_loops_and_tables_agree_with_xla(function):
    a = np.array([0.3, 2.0, 1e-8, 1e8, 4.0, 9.0, 1.0, 5.5, -0.7 if function is not _newton else 0.7])
    np.testing.assert_allclose(by_machine_code(function, a), by_xla(function, a), rtol=1e-13)


def test_an_array_too_large_for_registers_is_named_as_unsupported():
    with pytest.raises(Unsupported, match=r"\(100,\)"):
        by_machine_code(_nested, np.ones(8))


@pytest.mark.parametrize("places", [np.arange(0, 240, 2), jnp.arange(0, 240, 2), np.arange(100) - 240])
def test_a_gather_that_fills_beyond_the_ends_is_named_as_unsupported(places):
    def function(a: jax.Array) -> jax.Array:
        return (a * jnp.arange(200.0)).at[places].get(mode="fill", fill_value=-1.0)

    with pytest.raises(Unsupported, match="beyond the ends"):
        by_machine_code(function, np.ones(8))


def _weak(x: jax.Array) -> jax.Array:
    """The same numbers, of a kind that gives way to others: a conversion that converts nothing."""
    return lax.convert_element_type_p.bind(x, new_dtype=np.dtype(float), weak_type=True, sharding=None)


TRAPS: dict[str, Function] = {
    "a constant stays its own number when its kind changes": lambda a, b: (
        _weak(jnp.stack([jnp.asarray(5.0), a])[0]) / b
    ),
    "a number that is none is larger than any": lambda a, b: jnp.maximum(a, jnp.nan) + b,
    "a table looked up by small whole numbers": lambda a, b: jnp.arange(300.0)[(a * 10.0).astype("int8")],
    "the sign of what has none": lambda a, b: jnp.sign((a * 2.0**62).astype("uint64")),
    "a quotient that is cut to a whole number": lambda a, b: jnp.floor((3.0 * a) / a) + jnp.round(49.0 * b / b),
    "bits that do not matter are kept": lambda a, b: sum(lax.optimization_barrier((a, b))),
}


@pytest.mark.parametrize("name", TRAPS)
def test_rarely_used_conversions_and_signs_agree_with_xla(name):
    a, b = np.linspace(1.0, 12.0, 199), np.linspace(0.3, 49.0, 199)
    np.testing.assert_allclose(by_machine_code(TRAPS[name], a, b), by_xla(TRAPS[name], a, b), rtol=1e-15)


REFUSED: dict[str, Function] = {
    "fewer digits than a number has": lambda a, b: lax.reduce_precision(a, 8, 7),
    "rows put between the rows of a large array": lambda a, b: lax.pad(
        lax.scan(lambda c, x: (c, c * x), a, jnp.arange(100.0))[1], b, [(0, 0, 1)]
    ),
    "filled in beyond the end": lambda a, b: jnp.take(jnp.broadcast_to(a, (100,)), b.astype(int)),
    "filled in at a known place": lambda a, b: (
        jnp.stack([a, b]).at[jnp.array([0, 5])].get(mode="fill", fill_value=0).sum()
    ),
    "divided by what may be none": lambda a, b: lax.div(a.astype(int), b.astype(int)).astype(float),
    "the rest of a division by nothing": lambda a, b: lax.rem(a.astype(int), 0).astype(float),
    "a whole power that each member says": lambda a, b: a ** b.astype(int),
    "the sum of nothing": lambda a, b: jnp.stack([a, b])[:0].sum(),
}


@pytest.mark.parametrize("name", REFUSED)
def test_an_operation_without_a_translation_is_refused(name):
    with pytest.raises(Unsupported):
        by_machine_code(REFUSED[name], np.ones(8), np.ones(8))
