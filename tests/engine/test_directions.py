"""Derivatives along several directions of one run: the same as run by run, and what does not depend on them once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from smajax.engine import Along, EngineWarning, program
from smajax.engine.directions import Dependence
from smajax.engine.native import lanes_of
from smajax.engine.traced import Traced
from smajax.engine.translate import translate

DIRECTIONS, RUNS = 3, 21


class Model(eqx.Module):
    series: jax.Array


MODEL = Model(np.linspace(0.1, 0.9, 80))  # longer than what registers hold


def straight(x: jax.Array, y: jax.Array) -> jax.Array:
    return jnp.sin(x) * jnp.exp(-y) + jnp.where(x > y, x * y, y)


def looped(x: jax.Array, y: jax.Array) -> jax.Array:
    """A carry that does not depend on the direction, one that does from the start, and one that does from the second round on."""

    def body(carry: Any, now: jax.Array) -> Any:
        time, state, late = carry
        new = state + 0.1 * (now * x - jnp.tanh(state) * y)
        return (time + 0.1, new, 0.5 * late + state), (new * late, time)

    _, (states, times) = lax.scan(body, (jnp.zeros(()), x, jnp.zeros(())), MODEL.series)
    return jnp.concatenate([states, times])


def solved(x: jax.Array, y: jax.Array) -> jax.Array:
    """An iteration whose end does not depend on the direction, in a loop."""

    @jax.custom_jvp
    def root(a: jax.Array) -> jax.Array:
        return lax.while_loop(lambda z: jnp.abs(z * z - a) > 1e-12, lambda z: 0.5 * (z + a / z), a)

    @root.defjvp
    def _(primals: Any, tangents: Any) -> Any:
        at = root(*primals)
        return at, 0.5 * tangents[0] / at

    def body(carry: jax.Array, now: jax.Array) -> Any:
        return root(1.0 + carry * now + y * y), carry

    end, states = lax.scan(body, x * x, MODEL.series)
    return jnp.append(states, end)


def branched(x: jax.Array, y: jax.Array) -> jax.Array:
    return lax.cond(x > 0.5, lambda a, b: a * b, lambda a, b: a - 3.0 * b * b, x, y)


def called(x: jax.Array, y: jax.Array) -> jax.Array:
    return jax.jit(lambda a, b: jnp.stack([a * a, jnp.cos(b), a * b]).sum())(x, y)


FUNCTIONS = (straight, looped, solved, branched, called)


def along(function: Callable[[jax.Array, jax.Array], jax.Array]) -> Callable[[Any, Any], Any]:
    def derivative(model: Any, own: Any) -> Any:
        del model
        return jax.jvp(function, (own["x"], own["y"]), (own["dx"], own["dy"]))

    return derivative


def numbers() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    points = {name: rng.uniform(0.2, 1.0, RUNS) for name in ("x", "y")}
    return points | {name: rng.normal(size=(RUNS, DIRECTIONS)) for name in ("dx", "dy")}


def one_by_one(function: Callable[[Any, Any], Any], own: dict[str, np.ndarray]) -> Any:
    flat = {name: np.repeat(one, DIRECTIONS) if one.ndim == 1 else one.ravel() for name, one in own.items()}
    results = jax.vmap(lambda each: function(MODEL, each))({name: jnp.asarray(one) for name, one in flat.items()})
    return jax.tree.map(lambda leaf: np.asarray(leaf).reshape(RUNS, DIRECTIONS, *leaf.shape[1:]), results)


@pytest.mark.parametrize("engine", ["native", "xla"])
@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: one.__name__)
def test_derivatives_along_several_directions_are_those_one_by_one(function: Any, engine: Any) -> None:
    own, derivative = numbers(), along(function)
    made = program(derivative, MODEL, tuple(own), engine=engine, along=Along(("dx", "dy"), DIRECTIONS))
    for ours, theirs in zip(made(MODEL, own), one_by_one(derivative, own), strict=True):
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: one.__name__)
def test_what_does_not_depend_on_the_direction_is_computed_once(function: Any) -> None:
    names = ("x", "y", "dx", "dy")
    traced = Traced(along(function), MODEL, names)
    own = [False] * traced.shared + [True] * 4
    marked = [False] * traced.shared + [False, False, True, True]
    lengths = {}
    for count in (1, 2, 3):
        made = translate(traced.program, own, lanes_of({"float64"}), along=marked, directions=count)
        assert made.several == (False, True)
        assert len(made.results) == 1 + count
        lengths[count] = len(made.text.splitlines())
    # Each further direction adds far less than the whole program of one.
    assert max(lengths[3] - lengths[2], lengths[2] - lengths[1]) < 0.7 * lengths[1]


def test_a_carry_that_depends_on_the_direction_from_a_later_round_on_is_found() -> None:
    traced = Traced(along(looped), MODEL, ("x", "y", "dx", "dy"))
    jaxpr = traced.program.jaxpr
    found = Dependence()
    assert found.results(jaxpr, [False] * traced.shared + [False, False, True, True]) == [False, True]
    assert found.results(jaxpr, [False] * (traced.shared + 4)) == [False, False]
    assert found.results(jaxpr, [False] * traced.shared + [True, False, False, False]) == [True, True]


@pytest.mark.parametrize("which", ["loop", "branch"])
def test_a_way_that_depends_on_the_direction_is_left_to_xla(which: str) -> None:
    def turned(model: Any, own: Any) -> Any:
        if which == "branch":
            return lax.cond(own["dx"] > 0.0, jnp.sin, jnp.cos, own["x"])
        return lax.while_loop(lambda z: z < own["dx"], lambda z: 2.0 * z, own["x"])

    own = {name: one for name, one in numbers().items() if name in ("x", "dx")}
    with pytest.warns(EngineWarning, match="otherwise in each direction"):
        made = program(turned, MODEL, tuple(own), along=Along(("dx",), DIRECTIONS))
    np.testing.assert_allclose(made(MODEL, own), one_by_one(turned, own), rtol=1e-12)


def test_numbers_of_another_shape_than_runs_and_directions_are_refused() -> None:
    own, derivative = numbers(), along(straight)
    made = program(derivative, MODEL, tuple(own), along=Along(("dx", "dy"), DIRECTIONS))
    for wrong in (own["dx"][:, 0], own["dx"][:, :2], own["dx"][:5]):
        with pytest.raises(ValueError, match=r"of dx, dy shape \(runs, 3\)"):
            made(MODEL, {**own, "dx": wrong})


def test_a_run_whose_every_number_has_directions_is_computed() -> None:
    own = {"dx": numbers()["dx"]}
    made = program(
        lambda model, own: 2.0 * own["dx"], MODEL, ("dx",), engine="native", along=Along(("dx",), DIRECTIONS)
    )
    np.testing.assert_allclose(made(MODEL, own), 2.0 * own["dx"])


def test_results_that_are_on_their_way_have_directions_too() -> None:
    own, derivative = numbers(), along(straight)
    for engine in ("native", "xla"):
        made = program(derivative, MODEL, tuple(own), engine=engine, along=Along(("dx", "dy"), DIRECTIONS))
        coming = made.begin(MODEL, own, 1, (jax.devices("cpu")[0],), 8, 8)
        for ours, theirs in zip(coming(), one_by_one(derivative, own), strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("wrong", [Along(("dx",), 0), Along(("dz",), 3), Along(["dx"], 3), Along("dx", 3)])  # type: ignore[arg-type]
def test_directions_of_nothing_are_refused(wrong: Along) -> None:
    with pytest.raises(ValueError, match="some of the names"):
        program(along(straight), MODEL, tuple(numbers()), along=wrong)


def test_a_number_that_passes_a_barrier_beside_a_direction_does_not_depend_on_it() -> None:
    def steered(model: Any, own: Any) -> Any:
        del model

        def body(carry: Any, now: jax.Array) -> Any:
            x, dx = lax.optimization_barrier(carry)
            return (0.9 * x + now, dx * 0.5), lax.cond(x > 0.5, lambda a: 2.0 * a, lambda a: a - 1.0, dx)

        return lax.scan(body, (own["x"], own["dx"]), MODEL.series)[1]

    own = {name: one for name, one in numbers().items() if name in ("x", "dx")}
    made = program(steered, MODEL, tuple(own), engine="native", along=Along(("dx",), DIRECTIONS))
    np.testing.assert_allclose(made(MODEL, own), one_by_one(steered, own), rtol=1e-12)
