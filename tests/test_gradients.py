"""Automatic derivatives against central differences, through branch changes, for every parameter and coefficient."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.screen import switches
from smajax.attribution.search import NUDGE
from smajax.effects.library import LIBRARY
from smajax.extended import extended
from smajax.fit.problem import Problem
from smajax.parameters import get_parameters, parameters, set_parameters, set_vector
from smajax.presets import build
from smajax.simulate import simulate
from smajax.system import System

DT = 0.05


def _heated_and_cooled(top: float) -> jax.Array:
    return top * jnp.concatenate([jnp.full(120, 1.0), jnp.full(60, 0.6), jnp.full(60, 0.95), jnp.full(120, 0.0)])


def _coupon_inputs() -> dict[str, jax.Array]:
    temperature = jnp.concatenate(
        [jnp.linspace(25.0, 83.0, 80), jnp.linspace(83.0, 48.0, 70), jnp.linspace(48.0, 110.0, 90)]
    )
    return {"temperature": temperature, "stress": 1e6 * (60.0 + 10.0 * jnp.sin(0.05 * jnp.arange(240.0)))}


CASES: dict[str, tuple[System, dict[str, jax.Array]]] = {
    "arm": (build("niti_table_3_1", "arm", "amplified_voltage"), {"voltage": _heated_and_cooled(7.3)}),
    "dead_weight": (build("flexinol_table_3_2", "dead_weight", "voltage"), {"voltage": _heated_and_cooled(7.4)}),
    "bias_spring": (build("flexinol_ht_500um", "bias_spring", "duty"), {"duty": _heated_and_cooled(0.35)}),
    "coupon": (build("flexinol_table_3_2", "coupon", "none"), _coupon_inputs()),
}


def _compare(system: System, inputs: dict[str, jax.Array]) -> None:
    names = list(parameters(system))
    at = get_parameters(system, names)

    def features(vector: jax.Array) -> jax.Array:
        run = simulate(set_vector(system, names, vector), inputs, DT)
        # Smooth in time, so that a kink of one sample does not hide the derivative; several, so that none is blind.
        return jnp.stack(
            [run.reading.mean(), run.reading[150:].mean(), run.reading[-100:].mean(), run.temperature.mean()]
        )

    forward = np.asarray(jax.jit(jax.jacfwd(features))(at))
    evaluate = jax.jit(features)
    table = parameters(system)
    for index, name in enumerate(names):
        value, room = float(at[index]), table[name].high - table[name].low
        step = 1e-6 * (abs(value) or 1e-2 * room)
        if "." in name and abs(value) < 1e-2 * room:
            # A coefficient next to nothing: wide enough to rise above rounding, and not across zero.
            step = min(1e-5 * room, 0.1 * abs(value) or 1e-5 * room)
        # On a bound (a wire that starts as martensite) the difference is one-sided, of second order.
        inward = 1.0 if value - step < table[name].low else -1.0 if value + step > table[name].high else 0.0
        if inward:
            step = 1e-5 * room
            points = [evaluate(at.at[index].set(value + inward * k * step)) for k in (0, 1, 2)]
            difference = np.asarray((-3 * points[0] + 4 * points[1] - points[2]) / (2 * inward * step))
        else:
            difference = np.asarray(
                (evaluate(at.at[index].set(value + step)) - evaluate(at.at[index].set(value - step))) / (2 * step)
            )
        rounding = 1e-13 * np.abs(np.asarray(evaluate(at))).max() / step
        scale = np.abs(difference).max() * 1e-4 + rounding
        error = np.abs(forward[:, index] - difference).max()
        assert error <= scale, f"{name}: automatic {forward[:, index]}, differences {difference}"


@pytest.mark.parametrize("case", sorted(CASES))
def test_every_base_parameter(case: str) -> None:
    _compare(*CASES[case])


@pytest.mark.parametrize("effect", sorted(LIBRARY))
@pytest.mark.parametrize("share", [NUDGE, 1.0], ids=["next to nothing", "switched on"])
def test_every_effect_coefficient(effect: str, share: float) -> None:
    """At its start, and where its score is taken: at exactly zero a tail has no derivative (see `scores_at`)."""
    system, inputs = CASES["dead_weight"]
    starts = {
        name: size * (share if name in switches(effect) else 1.0)
        for name, size in ((f"{effect}.{key}", size) for key, size in LIBRARY[effect].starts.items())
    }
    _compare(extended(system, (effect,), starts), inputs)


def test_reverse_mode_agrees_with_forward_mode() -> None:
    system, inputs = CASES["dead_weight"]

    def final(value: jax.Array) -> jax.Array:
        run = simulate(set_parameters(system, {"convection_coefficient": value}), inputs, DT)
        return run.position.mean()

    at = jnp.asarray(150.0)
    assert float(jax.jit(jax.grad(final))(at)) == pytest.approx(float(jax.jit(jax.jacfwd(final))(at)), rel=1e-9)


def test_problem_slots_reach_the_parameter_they_name() -> None:
    """A lane that frees one parameter changes that one and nothing else."""
    from smajax.fit.batch import RunBatch
    from smajax.fit.problem import free_of, values_of

    system, inputs = CASES["dead_weight"]
    n = len(inputs["voltage"])
    batch = RunBatch(
        {"voltage": inputs["voltage"][None]}, jnp.zeros((1, n)), jnp.ones((1, n)), jnp.zeros((1, 0)), (), DT
    )
    problem = Problem.build(system, batch, 1e-5, True)
    start = problem.start_values()
    lane = problem.lane(["specific_heat"], {"specific_heat": (200.0, 1000.0)}, start, 3)
    same = np.asarray(values_of(free_of(lane), lane))
    np.testing.assert_allclose(same[:-1], start[:-1], rtol=1e-12)
    moved = np.asarray(values_of(free_of(lane) + 0.5, lane))
    changed = [name for k, name in enumerate(problem.names) if abs(moved[k] - start[k]) > 1e-12 * abs(start[k])]
    assert changed == ["specific_heat"]
