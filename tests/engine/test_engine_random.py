"""Programs drawn at random, loops in loops in loops, as machine code: to the last digit what XLA makes of them.

All numbers are whole and below 64, so that no order of operations rounds.
"""

from __future__ import annotations

import random
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from tests.helpers.engine_results import by_machine_code, by_xla

MEMBERS = 77  # fill no vector and no group of vectors
KINDS = ("float64", "int64", "int8", "bool")
OFTEN = (6, 1, 1, 3)
DEEPEST, LOOPS = 3, (0.35, 0.5, 0.4)  # how often there is one
ARITHMETIC: tuple[Callable[[jax.Array, jax.Array], jax.Array], ...] = (jnp.add, jnp.subtract, jnp.multiply, jnp.maximum)
COMPARED = (jnp.less, jnp.equal, jnp.greater_equal)
LOGIC = (jnp.logical_and, jnp.logical_or, jnp.logical_xor)
Pool = list[jax.Array]  # what has a value so far
Carried = list[Pool]  # by the loops around, the outermost first


def _wrapped(x: jax.Array) -> jax.Array:
    return x - 64.0 * jnp.floor(x / 64.0) if x.dtype == float else x & jnp.asarray(63, x.dtype)


def _pick(rng: random.Random, pool: Pool, kind: str) -> jax.Array:
    """One of a kind, more often a late one; now and then a constant."""
    found = [one for one in pool if one.dtype == kind]
    if not found or rng.random() < 0.06:
        return jnp.asarray(rng.randrange(2 if kind == "bool" else 60), kind)
    return rng.choice(found[-6:] if rng.random() < 0.6 else found)


def _operation(rng: random.Random, pool: Pool) -> None:
    kind = rng.choices(KINDS, OFTEN)[0]
    one, other = _pick(rng, pool, kind), _pick(rng, pool, kind)
    how = rng.random()
    if how < 0.25:
        found = jnp.where(_pick(rng, pool, "bool"), one, other)
    elif how < 0.35:
        before = _pick(rng, pool, rng.choice(KINDS))
        found = before.astype(float) > 20.0 if kind == "bool" else before.astype(kind)
    elif kind == "bool" and how < 0.75:
        left = rng.choice(KINDS[:3])
        found = rng.choice(COMPARED)(_pick(rng, pool, left), _pick(rng, pool, left))
    elif kind == "bool":
        found = rng.choice(LOGIC)(one, other)
    else:
        found = _wrapped(rng.choice(ARITHMETIC)(one, other))
    pool.append(found)


def _begin(rng: random.Random, pool: Pool, above: Carried, most: int) -> Pool:
    """What a loop begins with: often what one around it carries."""
    outer = rng.choice(above) if above and rng.random() < 0.6 else pool
    if outer is not pool and rng.random() < 0.5:
        return list(outer)
    return [_pick(rng, outer, kind) for kind in rng.choices(KINDS, OFTEN, k=rng.randrange(1, most))]


def _ends(rng: random.Random, carried: Pool, pool: Pool) -> tuple[jax.Array, ...]:
    """What a round leaves: itself, another of the carried ones (they change places), or anything of its kind."""

    def end(was: jax.Array) -> jax.Array:
        how = rng.random()
        if how < 0.3:
            return was if how < 0.12 else rng.choice([one for one in carried if one.dtype == was.dtype])
        return _pick(rng, pool[-8:] if how < 0.6 else pool, str(was.dtype))

    return tuple(end(one) for one in carried)


def _counted(rng: random.Random, pool: Pool, above: Carried, depth: int) -> None:
    """A loop of so many rounds, forwards or backwards, that may keep a number of each round."""
    begin = tuple(_begin(rng, pool, above, 6))
    length, keeps = rng.choice((1, 2, 3, 70)) if depth == 0 else rng.choice((1, 2, 3)), rng.random() < 0.5
    seed = rng.random()

    def body(carry: tuple[jax.Array, ...], x: jax.Array) -> tuple[tuple[jax.Array, ...], jax.Array | None]:
        own, inside = random.Random(seed), [*pool, *carry, x]
        _block(own, inside, [*above, list(carry)], depth + 1)
        return _ends(own, list(carry), inside), _pick(own, inside, "float64") if keeps else None

    series = jnp.arange(float(length)) * 7.0 % 64.0
    end, kept = lax.scan(body, begin, series, reverse=rng.random() < 0.3)
    pool += end
    if kept is not None:
        index = jnp.clip(_pick(rng, pool, "int64"), 0, length - 1)
        pool += [kept[index], _wrapped(kept.sum())]


def _uncounted(rng: random.Random, pool: Pool, above: Carried, depth: int) -> None:
    """Rounds from none to seven, by the member."""
    begin = tuple(_begin(rng, pool, above, 5))
    most, seed, asked = _pick(rng, pool, "int64") & 7, rng.random(), rng.random() < 0.4

    def going(now: tuple[jax.Array, ...]) -> jax.Array:
        own, inside = random.Random(seed), [*pool, *now[1:]]
        _operation(own, inside)
        more = now[0] < most
        return more & (_pick(own, inside, "bool") | (now[0] < 1)) if asked else more

    def body(now: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        own, inside = random.Random(seed + 1.0), [*pool, *now]
        _block(own, inside, [*above, list(now[1:])], depth + 1)
        return now[0] + 1, *_ends(own, list(now[1:]), inside)

    pool += lax.while_loop(going, body, (jnp.zeros((), int), *begin))[1:]


def _either(rng: random.Random, pool: Pool, above: Carried, depth: int) -> None:
    seeds, kinds = [rng.random() for _ in range(3)], rng.choices(KINDS, OFTEN, k=2)

    def branch(seed: float) -> Callable[[], tuple[jax.Array, ...]]:
        def found() -> tuple[jax.Array, ...]:
            own, inside = random.Random(seed), list(pool)
            _block(own, inside, above, depth + 1)
            return tuple(_pick(own, inside, kind) for kind in kinds)

        return found

    pool += lax.switch(jnp.clip(_pick(rng, pool, "int64") - 20, 0, 2), [branch(seed) for seed in seeds])


def _block(rng: random.Random, pool: Pool, above: Carried, depth: int) -> None:
    for _ in range(rng.randrange(1, 5) if depth else rng.randrange(4, 10)):
        how = rng.random()
        if depth < DEEPEST and how < LOOPS[depth]:
            rng.choice((_counted, _counted, _uncounted, _either))(rng, pool, above, depth)
        else:
            # Now and then more than a phase holds.
            for _ in range(rng.choice((1, 2, 3, 5, 80 if depth < 2 else 8))):
                _operation(rng, pool)


def _program(seed: int) -> Callable[..., jax.Array]:
    def member(a: jax.Array, b: jax.Array) -> jax.Array:
        rng, pool = random.Random(seed), [a, b, a.astype(int), b.astype("int8"), a > b]
        _block(rng, pool, [], 0)
        return jnp.stack([one.astype(float) for one in rng.sample(pool, 4)] + [one.astype(float) for one in pool[-4:]])

    return member


def _agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.integers(0, 64, (2, MEMBERS)).astype(float)
    wanted = by_xla(_program(seed), a, b)
    for vectors, mask in ((8, "i1"), (3, "i64"), (1, "i1")):
        found = by_machine_code(_program(seed), a, b, vectors=vectors, mask=mask)
        np.testing.assert_array_equal(found, wanted, err_msg=f"seed {seed}, {vectors} vectors, masks of {mask}")


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (3, 4, 5, 239))])
def test_a_random_program_equals_xla(seed: int) -> None:
    _agree(seed)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(100, 400, 50))
def test_many_random_programs_equal_xla(first: int) -> None:
    for seed in range(first, first + 50):
        _agree(seed)
