"""C of a traced program gives what JAX gives of it: arithmetic, arrays, loops, branches; and says what it has no C for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from jax import lax

from smajax.export.block import Block, Quantity
from smajax.export.compiled import compiled
from smajax.export.errors import NoTranslation
from smajax.export.single_precision import DOUBLE, SINGLE
from tests.helpers.c_programs import compiled_c, needs_gcc, source_of

NAMES = ("a", "b", "c")


def block_of(function: Callable[..., Any], outputs: int) -> Block:
    """`function` of three numbers and of its own last result gives a vector."""
    names = [f"y{k}" for k in range(outputs)]

    def named(result: Any) -> tuple[Any, dict[str, Any]]:
        flat = jnp.asarray(result, dtype=float).reshape(-1)
        return flat, {name: flat[k] for k, name in enumerate(names)}

    def start(p: Any, u: Any) -> Any:
        return named(jnp.zeros(outputs))

    def step(p: Any, x: Any, u: Any, seconds: Any) -> Any:
        return named(function(u["a"], u["b"], u["c"], x))

    inputs = tuple(Quantity(name, "1", "") for name in NAMES)
    return Block("block", "a test", (), inputs, tuple(Quantity(name, "1", "") for name in names), start, step, 1.0)


def agree(function: Callable[..., Any], folder: Path, kind: str = DOUBLE, rows: int = 40, seed: int = 0) -> None:
    """Over rows of random numbers, the state carried on."""
    outputs = int(np.prod(jax.eval_shape(function, *[jnp.zeros(())] * 3, jnp.zeros(64)).shape))
    source = source_of(lambda: block_of(function, outputs))
    instance = compiled_c(source, folder, kind, arithmetic=kind)()
    instance.run({})
    x, function = jnp.zeros(outputs), jax.jit(function)
    tolerance = 1e-12 if kind == DOUBLE else 2e-5
    for row in np.random.default_rng(seed).normal(0.0, 2.0, (rows, 3)):
        expected = np.asarray(function(*map(jnp.asarray, row), x)).reshape(-1)
        found = instance.run(dict(zip(NAMES, row, strict=True)))
        np.testing.assert_allclose(list(found.values()), expected, rtol=tolerance, atol=tolerance)
        x = jnp.asarray(expected)


def arithmetic(a, b, c, x):
    positive = jnp.abs(a) + 0.1
    return jnp.stack(
        [
            a * b - c / positive,
            jnp.sqrt(positive) + jnp.exp(-positive) + jnp.log(positive) + jnp.log1p(positive) + jnp.expm1(-positive),
            jnp.sin(a) + jnp.cos(b) * jnp.tan(c / 10) + jnp.arctan2(a, b) + jnp.tanh(c) + jnp.arctan(a),
            jnp.arcsin(jnp.tanh(a)) + jnp.arccos(jnp.tanh(b)) + jnp.sinh(c) + jnp.cosh(a),
            positive**b + a**3 + positive**-2 + jnp.square(c) + lax.rsqrt(positive) + jnp.cbrt(a),
            jnp.maximum(a, b) + jnp.minimum(b, c) + jnp.sign(a) + jnp.abs(c) + jnp.clip(a, -1.0, b + 5.0),
            jnp.floor(a) + jnp.ceil(b) + jnp.round(c) + jnp.fmod(a, 0.7) + jnp.mod(b, 0.7) + jnp.trunc(a),
            jnp.where((a > b) & ~(c > 0) | (a == b), a, jnp.where(b != c, b, c)) + jax.nn.sigmoid(a) + jax.nn.relu(b),
            jnp.floor(a).astype(int) // 3 + (b > 0).astype(float) + (a.astype(int) % 4) + lax.erf(a),
            jnp.where(jnp.isfinite(a / jnp.where(b > 0, 0.0, 1.0)), a, b) + jnp.isnan(c).astype(float),
        ]
    )


def arrays(a, b, c, x):
    matrix = jnp.stack([jnp.stack([a, b, c]), jnp.stack([b, c, a]), jnp.stack([c, a, 3.0 + b])])
    vector = jnp.concatenate([matrix[0, 1:], a[None]]) + jnp.arange(3)
    turned = matrix.T @ vector + jnp.outer(vector, vector).sum(axis=0) - jnp.flip(vector)
    chosen = matrix.at[1, 2].set(5.0)[1:, ::2].ravel()
    parts = jnp.split(jnp.pad(vector, (1, 2)), 2)
    every = jnp.einsum("ij,jk,k->i", matrix, matrix, vector) + jnp.cumsum(vector)
    return jnp.concatenate(
        [turned, chosen, parts[1], every, matrix.max(axis=1), matrix.min(axis=0), vector.prod()[None]]
    )


def unrolled(a, b, c, x):
    def body(carry, row):
        one, other = carry
        return (other, one * row + b), one + row

    (one, other), rows = lax.scan(body, (a, c), jnp.stack([a, b, 2.0 * b, c]))
    (back, _), matrix = lax.scan(
        lambda at, row: ((at[1], at[0] + row.sum()), row * at[0]), (a, b), jnp.outer(rows, rows[:2]), reverse=True
    )
    nested, _ = lax.scan(lambda at, _: (lax.fori_loop(0, 3, lambda k, s: 0.5 * s + k * b, at), None), c, None, length=2)
    return jnp.concatenate([jnp.stack([one, other, back, nested]), rows, matrix.ravel()])


def looped(a, b, c, x):
    def halve(at):
        number, value = at
        return number + 1, value / 2 + jnp.where(number > 3, 0.01, 0.0) * b

    number, value = lax.while_loop(lambda at: (at[0] < 30) & (jnp.abs(at[1]) > 0.05), halve, (0, 10.0 * a))
    inner = lax.while_loop(
        lambda s: s < 3.0, lambda s: lax.while_loop(lambda t: t < s, lambda t: t + 1.1, s - 2.0) + 1.0, c
    )
    return jnp.stack([jnp.asarray(number, dtype=float), value, inner])


def branched(a, b, c, x):
    first = lax.cond(a > 0, lambda: (a * b, c), lambda: (b, jnp.exp(-(a**2))))
    which = jnp.floor(jnp.abs(b)).astype(int)
    second = lax.switch(which, [lambda: a, lambda: lax.cond(c > 0, lambda: b, lambda: -b), lambda: c])
    row = jnp.stack([a, b, c])
    return jnp.stack([*first, second, row[jnp.clip(which, 0, 2)]])


def remembered(a, b, c, x):
    return jnp.stack([0.9 * x[0] + a, jnp.where(x[0] > b, x[1] + 1.0, 0.5 * x[1]), x[1] - x[0]])


def derived(a, b, c, x):
    def f(v):
        return jnp.stack([jnp.sin(v[0]) * v[1], v[0] ** 2 + jnp.exp(-(v[1] ** 2))])

    v = jnp.stack([a, b])
    covariance = jax.jacfwd(f)(v) @ jax.jacrev(f)(v).T + 3.0 * jnp.eye(2)
    return jnp.concatenate([jax.hessian(lambda v: f(v).sum())(v).ravel(), jnp.linalg.cholesky(covariance).ravel()])


PROGRAMS = [arithmetic, arrays, unrolled, looped, branched, remembered, derived]


# In single precision rounding moves a number of `arithmetic` over an edge of floor, and one of `looped` over a loop's end.
@needs_gcc
@pytest.mark.parametrize(
    ("function", "kind"),
    [(one, DOUBLE) for one in PROGRAMS] + [(one, SINGLE) for one in PROGRAMS if one not in (arithmetic, looped)],
)
def test_the_c_of_a_program_gives_what_jax_gives(function, kind, tmp_path):
    agree(function, tmp_path, kind)


UNARY: list[Callable[..., Any]] = [
    jnp.sin,
    jnp.tanh,
    jnp.square,
    lambda v: -v,
    jnp.abs,
    lambda v: 1.0 / (1.0 + v * v),
    lambda v: jnp.exp(-v * v),
]
BINARY: list[Callable[..., Any]] = [
    jnp.add,
    jnp.subtract,
    jnp.multiply,
    jnp.maximum,
    jnp.minimum,
    lambda v, w: jnp.where(v > w, v, 0.5 * w),
]
CONSTANTS = [0.0, 1.0, -1.0, 0.3, 2.0]


def random_program(seed: int) -> Callable[..., Any]:
    """Arithmetic on what came before, with some of it in loops and branches."""

    def program(a, b, c, x):
        random = np.random.default_rng(seed)
        values = [a, b, c, x[0], x[1]]

        def grown(values, count):
            values = list(values)
            for _ in range(count):
                one, other = (values[random.integers(len(values))] for _ in range(2))
                if random.random() < 0.2:
                    other = jnp.asarray(CONSTANTS[random.integers(len(CONSTANTS))])
                if random.random() < 0.4:
                    values.append(UNARY[random.integers(len(UNARY))](one))
                else:
                    values.append(jnp.tanh(BINARY[random.integers(len(BINARY))](one, other)))
            return values

        values = grown(values, 6)
        state = random.bit_generator.state
        length = int(random.integers(1, 4))

        def body(carry, row):
            random.bit_generator.state = state
            new = grown([*carry, row, values[-1]], 5)
            return (new[-1], new[-3]), new[-2]

        carry, rows = lax.scan(body, (values[-1], values[-2]), jnp.stack(values[:length]))
        values += [*carry, rows[-1]]
        ways = [grown(values, 3)[-1] for _ in range(2)]
        values.append(lax.cond(values[-1] > values[0], lambda: ways[0] * 2.0, lambda: ways[1] + values[1]))
        values = grown(values, 4)
        return jnp.stack(values[-3:])

    return program


@needs_gcc
@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6))
def test_the_c_of_random_programs_gives_what_jax_gives(seed, tmp_path_factory):
    agree(random_program(seed), tmp_path_factory.mktemp("program"), rows=10, seed=seed)


def test_what_nothing_comes_of_is_left_out():
    def start(p, u):
        return {"kept": u["a"], "counted": jnp.zeros(()), "idle": jnp.zeros(3)}, {"y": u["a"]}

    def step(p, x, u, seconds):
        later = {"kept": x["kept"] * p["gain"], "counted": x["counted"] + u["b"], "idle": jnp.sin(x["idle"])}
        return later, {"y": later["kept"]}

    quantities = {name: Quantity(name, "1", "") for name in ("gain", "spare", "a", "b", "y")}
    own = Block(
        "block",
        "",
        (quantities["gain"], quantities["spare"]),
        (quantities["a"], quantities["b"]),
        (quantities["y"],),
        start,
        step,
        1.0,
    )
    found = compiled(lambda: own, DOUBLE)
    assert [one.name for one in found.state] == ["kept"]
    assert found.parameters == {"gain"}
    assert found.inputs == {"a"}
    assert found.step.cost.total == 1


def test_loops_are_counted_at_their_worst():
    found = compiled(lambda: block_of(looped, 3), DOUBLE).step.cost
    assert not found.bounded  # the inner one ends by its numbers
    first = compiled(
        lambda: block_of(lambda a, b, c, x: lax.fori_loop(0, 7, lambda k, s: s * a, b), 1), DOUBLE
    ).step.cost
    assert first.bounded
    assert first.operations["mul"] == 7

    def search(a, b, c, x):
        return lax.while_loop(lambda at: (at[0] < 12) & (at[1] > c), lambda at: (at[0] + 1, at[1] * a), (2, b))[1]

    found = compiled(lambda: block_of(search, 1), DOUBLE).step.cost
    assert found.bounded
    assert found.operations["mul"] == 10


def sorting_law(values):
    return jnp.sort(values)


def test_an_operation_without_c_is_named_with_the_function_that_asks_for_it():
    with pytest.raises(NoTranslation, match=r"`sorting_law` of test_translation.py .*cannot be exported: .*`sort`"):
        compiled(lambda: block_of(lambda a, b, c, x: sorting_law(jnp.stack([a, b])), 2), DOUBLE)
