"""Automatic derivatives against central differences, through branch changes, for every parameter of the base models.

Those of every effect are in `test_every_effect`.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.engine import Engine
from smajax.fit.problem import Problem
from smajax.model.presets import build
from smajax.model.system import System
from smajax.simulation.simulate import simulate
from tests.helpers.derivatives import compare, open_loop
from tests.helpers.often import often

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


# The loads of the others are under other laws in `test_law_gradients`; one rig by the other engine too.
@pytest.mark.parametrize(
    ("case", "engine"),
    often([*((case, "native") for case in sorted(CASES)), ("arm", "xla")], [("arm", "native"), ("coupon", "native")]),
)
def test_derivatives_in_every_base_parameter_agree_with_differences(case: str, engine: Engine) -> None:
    compare(CASES[case][0], open_loop(CASES[case][1], DT), engine=engine)


@pytest.mark.parametrize("case", ["dead_weight", "bias_spring"])
def test_a_run_that_is_differentiated_once_has_the_same_derivative(case: str) -> None:
    system, inputs = CASES[case]

    def position(once: bool) -> tuple[np.ndarray, np.ndarray]:
        def run(value: jax.Array) -> jax.Array:
            return simulate(set_parameters(system, {"convection_coefficient": value}), inputs, DT, once=once).position

        value = jnp.asarray(120.0)
        values, slopes = jax.jit(lambda: jax.jvp(run, (value,), (jnp.ones_like(value),)))()
        return np.asarray(values), np.asarray(slopes)

    (values, slopes), (alone, slopes_once) = position(False), position(True)
    np.testing.assert_allclose(alone, values, atol=1e-5 * np.abs(values).max())
    assert np.abs(slopes).max() > 0.0
    np.testing.assert_allclose(slopes_once, slopes, atol=1e-4 * np.abs(slopes).max())


@pytest.mark.slow
def test_reverse_mode_agrees_with_forward_mode() -> None:
    system, inputs = CASES["dead_weight"]

    def final(value: jax.Array) -> jax.Array:
        run = simulate(set_parameters(system, {"convection_coefficient": value}), inputs, DT)
        return run.position.mean()

    at = jnp.asarray(150.0)
    assert float(jax.jit(jax.grad(final))(at)) == pytest.approx(float(jax.jit(jax.jacfwd(final))(at)), rel=1e-9)


def test_each_slot_of_a_problem_changes_the_parameter_that_it_names() -> None:
    """A fit that frees one parameter changes that one and nothing else."""
    from smajax.fit.packed_runs import RunBatch

    system, inputs = CASES["dead_weight"]
    n = len(inputs["voltage"])
    batch = RunBatch(
        {"voltage": inputs["voltage"][None]}, jnp.zeros((1, n)), jnp.ones((1, n)), jnp.zeros((1, 0)), (), DT
    )
    problem = Problem.build(system, batch, 1e-5, True)
    start = problem.start_values()
    task = problem.task(["specific_heat"], {"specific_heat": (200.0, 1000.0)}, start)
    same = task.values_at(task.initial_guess)
    np.testing.assert_allclose(same[:-1], start[:-1], rtol=1e-12)
    moved = task.values_at(task.initial_guess + 0.1)
    changed = [name for k, name in enumerate(problem.names) if abs(moved[k] - start[k]) > 1e-12 * abs(start[k])]
    assert changed == ["specific_heat"]
