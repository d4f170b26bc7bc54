"""Programs of one member as machine code over lanes: the same numbers as XLA's, for arithmetic, loops, and whole runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax import lax

from smajax.core.checkpointed_scan import checkpointed_scan, recomputed, solved
from smajax.engine import Engine, EngineWarning, Unsupported, program
from smajax.engine.kernel import Kernel, compiled
from smajax.engine.translate import VECTORS, translate
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import sampled, zipped
from smajax.simulation.batch.chunks import chunks
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Largest, Last, Mean, MeanSquare

Function = Callable[..., jax.Array]
Numbers = tuple[Any, ...]
ODD = [0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -2.5, 1e-300, -1e300, 1e308, np.inf, -np.inf, np.nan, 3.0, 1e-9, 7.1]


def by_machine_code(
    function: Function,
    *own: np.ndarray,
    lanes: int = 8,
    wide: bool = False,
    vectors: int = VECTORS,
    mask: str = "i1",
) -> np.ndarray:
    """`function` of every member by the translator."""
    program = jax.make_jaxpr(function)(*(jnp.zeros((), one.dtype) for one in own))
    translated = translate(program, [True] * len(own), lanes, wide, vectors, mask)
    kernel = Kernel(compiled(translated), translated.lanes, translated.results, translated.scratch)
    return kernel([], [np.ascontiguousarray(one) for one in own], threads=1)[0]


def by_xla(function: Function, *own: np.ndarray) -> np.ndarray:
    """As XLA optimises it: other tests do without (tests/conftest.py), and a product and a sum are then rounded one by one."""
    return np.asarray(jax.jit(jax.vmap(function), compiler_options={"xla_backend_optimization_level": 3})(*own))


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
def test_arithmetic_agrees_to_the_bit_also_for_what_is_no_number(name):
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
def test_functions_agree(function):
    x = np.linspace(0.01, 3.0, 16)
    np.testing.assert_allclose(by_machine_code(function, x), by_xla(function, x), rtol=1e-14)


# XLA's own logarithm is off by 2e-14 in older versions: what is compared with is exact.
EXACT = {"expm1": (jnp.expm1, np.expm1), "log1p": (jnp.log1p, np.log1p), "erf_inv": (lax.erf_inv, None)}


@pytest.mark.parametrize(("function", "exact"), EXACT.values(), ids=EXACT)
def test_functions_agree_near_zero_and_at_their_ends(function, exact):
    """Where the plain formula would leave no digit, and where it would be nothing times infinity."""
    ends = [-1.0, 0.0, 1e-300, -1e-12, 1e-5, np.nan]
    ends += [1.0, 1.0 - 1e-15] if function is lax.erf_inv else [np.inf, 709.5, 1e300]
    ends += [-np.inf, -700.0, -1e4] if function is jnp.expm1 else []
    x = np.concatenate([np.linspace(-0.999, 0.999, 500), ends])
    with np.errstate(all="ignore"):
        wanted = by_xla(function, x) if exact is None else exact(x)
    np.testing.assert_allclose(by_machine_code(function, x), wanted, rtol=1e-14)


@pytest.mark.parametrize("count", [5, 300])
def test_noise_is_that_of_jax(count):
    """Numbers drawn inside of the program, from a key that is the run's own; few in registers, many in memory."""

    def drawn(number):
        key, _ = jax.random.split(jax.random.fold_in(jax.random.key(3), number.astype(int)))
        return jax.random.normal(key, (count,)) + jax.random.uniform(key, (count,))

    numbers = np.arange(21.0)
    np.testing.assert_allclose(by_machine_code(drawn, numbers), by_xla(drawn, numbers), rtol=0.0, atol=1e-14)


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
def test_loops_and_tables_agree(function):
    a = np.array([0.3, 2.0, 1e-8, 1e8, 4.0, 9.0, 1.0, 5.5, -0.7 if function is not _newton else 0.7])
    np.testing.assert_allclose(by_machine_code(function, a), by_xla(function, a), rtol=1e-13)


def test_what_is_too_large_for_registers_and_no_plain_series_is_named():
    with pytest.raises(Unsupported, match=r"\(100,\)"):
        by_machine_code(_nested, np.ones(8))


@pytest.mark.parametrize("places", [np.arange(0, 240, 2), jnp.arange(0, 240, 2), np.arange(100) - 240])
def test_what_is_gathered_beyond_the_ends_and_replaced_there_is_named(places):
    def function(a: jax.Array) -> jax.Array:
        return (a * jnp.arange(200.0)).at[places].get(mode="fill", fill_value=-1.0)

    with pytest.raises(Unsupported, match="beyond the ends"):
        by_machine_code(function, np.ones(8))


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


@pytest.mark.parametrize(("vectors", "mask"), [(1, "i1"), (3, "i1"), (8, "i1"), (8, "i64")])
@pytest.mark.parametrize(
    "function", [_busy, _crosswise, _late, _uneven, _begun_again, _small], ids=lambda one: one.__name__
)
def test_phases_over_any_number_of_vectors_are_the_whole_program(function, vectors, mask):
    a = np.arange(150.0) % 41.0 - 3.0
    np.testing.assert_array_equal(by_machine_code(function, a, vectors=vectors, mask=mask), by_xla(function, a))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=40), st.sampled_from([2, 4, 8, 16, 32]))
def test_any_number_of_members_in_any_number_of_lanes(values, lanes):
    own = np.array(values)
    found = by_machine_code(lambda a: jnp.where(a > 1.0, a * a, -a), own, lanes=lanes)
    np.testing.assert_array_equal(found, np.where(own > 1.0, own * own, -own))


def same_batch(ours, theirs, share):
    """Every series and measure to a share of its largest value, and the same members gone wrong."""
    assert set(ours) == set(theirs)
    for name in ours:
        scale = float(np.abs(theirs[name]).max())
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0.0, atol=share * scale, err_msg=str(name))
    np.testing.assert_array_equal(ours["status"], theirs["status"])


def _runs(engine: Engine):
    axes = sampled(37, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=1)
    keep = ("position", "temperature", "martensite_fraction", "stress")
    measures = (
        Last("position"),
        Largest("stress"),
        Mean("temperature"),
        MeanSquare("position", jnp.linspace(0, 1, 401)),
    )
    return run_batch(arm(), {}, axes, seconds=2.0, every=8, keep=keep, measures=measures, engine=engine)


def test_a_batch_of_arms_is_that_of_xla():
    same_batch(_runs("native"), _runs("xla"), 1e-10)


def test_a_member_is_the_same_to_the_bit_whatever_runs_beside_it():
    axes = sampled(50, voltage=(5.5, 8.5), payload_mass=(0.05, 0.09), seed=2)
    box = axes.runs(0, 50)

    def run(first: int, last: int, threads: int) -> np.ndarray:
        part = zipped({name: series[first:last] for name, series in box.items()})
        devices = jax.local_devices() * threads
        return run_batch(arm(), {}, part, seconds=1.0, keep=(), measures=(Last("stress"),), devices=devices)[
            "last_stress"
        ].to_numpy()

    whole = run(0, 50, 1)
    np.testing.assert_array_equal(run(0, 50, 3), whole)
    np.testing.assert_array_equal(run(17, 18, 1), whole[17:18])
    np.testing.assert_array_equal(run(31, 50, 2), whole[31:])


def test_a_member_that_is_no_number_does_not_disturb_the_others():
    load = np.linspace(0.0, 0.1, 20)  # N m
    good = run_batch(arm(), {"voltage": 7.0}, zipped({"load_torque": load}), seconds=1.0, keep=("stress",), every=20)
    load[3] = 1e300
    mixed = run_batch(arm(), {"voltage": 7.0}, zipped({"load_torque": load}), seconds=1.0, keep=("stress",), every=20)
    others = np.arange(20) != 3
    assert mixed["status"].to_numpy()[3] == 1
    np.testing.assert_array_equal(mixed["stress"].to_numpy()[others], good["stress"].to_numpy()[others])


def test_a_function_with_no_translation_runs_by_xla_or_says_why():
    def sorted_pair(model, own):
        return {"least": jnp.sort(jnp.stack([own["a"], own["b"]]))[0]}

    axes = zipped({"a": np.array([1.0, 2.0, 3.0]), "b": np.array([3.0, 1.0, 2.0])})
    with pytest.raises(Unsupported, match="sort"):
        program(sorted_pair, None, ("a", "b"), engine="native")
    with pytest.warns(EngineWarning, match="`sort`"):
        ((_, found),) = chunks(sorted_pair, None, axes, 3, [0])
    np.testing.assert_array_equal(found["least"], [1.0, 1.0, 2.0])
    with pytest.raises(Unsupported, match="`sort`"):
        list(chunks(sorted_pair, None, axes, 3, [0], engine="native"))


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
def test_traps(name):
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
def test_what_has_no_translation_is_refused(name):
    with pytest.raises(Unsupported):
        by_machine_code(REFUSED[name], np.ones(8), np.ones(8))


def test_arrays_of_numpy_in_any_layout_and_numbers_of_any_kind():
    def total(model, own):
        return {"sum": own["a"] * model["t"].sum() + jnp.asarray(model["n"]).astype(float)}

    axes = zipped(a=[1.0, 2.0])
    for number in (1, 1.5, True):
        for array in (np.arange(10.0)[::2], np.arange(12.0).reshape(3, 4).T[1], np.arange(5, dtype="float32")):
            ((_, found),) = chunks(total, {"t": array, "n": number}, axes, 2, [0], engine="native")
            np.testing.assert_allclose(found["sum"], np.array([1.0, 2.0]) * array.sum() + float(number))
