"""Lever, inertia and resistance of a load, as controllers read them, are those of its own equation of motion."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.load_equation import (
    LoadEquation,
    equation_of,
    force_per_stress,
    lever_by_virtual_work,
    missing_for_equation,
    moving_load,
    stroke_of,
)
from smajax.control.presets import quick_stress_sliding
from smajax.model.extended import extended
from smajax.model.presets import arm, bias_spring, build, dead_weight
from smajax.model.system import System
from tests.helpers.own_load import Lever, Scheduled

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
HANGING = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SPRING = build("flexinol_ht_500um", "bias_spring", "voltage")


OWN = dataclasses.replace(HANGING, load=Lever())
STATES = [(0.1, 0.0), (-0.3, 2.0), (0.9, -1.5)]


def test_the_arm_s_lever_and_resistance_are_those_of_the_hand_written_equation() -> None:
    """Eq. 3.8 with 2 r, as controllers had it written out for the arm."""
    load, equation = arm(), equation_of(ARM)
    radius, length = float(load.pulley_radius), float(load.arm_length)
    payload, link = float(load.payload_mass), float(load.link_mass)
    assert float(equation.lever()) == pytest.approx(2.0 * radius, rel=1e-12)
    assert float(force_per_stress(ARM)) == pytest.approx(2.0 * radius * np.pi * 75e-6**2, rel=1e-12)
    assert float(equation.inertia()) == pytest.approx((payload + link / 3.0) * length**2, rel=1e-12)
    for angle, rate in STATES:
        gravity = (payload + 0.5 * link) * 9.81 * length * np.cos(angle)
        spring = float(load.spring_stiffness) * float(load.spring_lever) ** 2 * (angle - float(load.spring_rest_angle))
        expected = gravity + spring + float(load.damping) * rate
        assert float(equation.resistance(jnp.asarray(angle), jnp.asarray(rate))) == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("system", [ARM, HANGING, SPRING, OWN], ids=["arm", "dead weight", "bias spring", "own"])
def test_the_lever_by_virtual_work_is_the_load_s(system: System) -> None:
    """What the wire's stress does along the strain of the geometry, it does with the lever along the position."""
    work = lever_by_virtual_work(moving_load(system), system.wire)
    np.testing.assert_allclose(work, equation_of(system).lever(), rtol=1e-10)


@pytest.mark.parametrize("system", [ARM, HANGING, SPRING, OWN], ids=["arm", "dead weight", "bias spring", "own"])
def test_derivatives_of_the_resistance_agree_with_differences_of_the_load_s_own_equation(system: System) -> None:
    load, equation, step = moving_load(system), equation_of(system), 1e-6
    start, stroke = float(load.start()), float(stroke_of(system))
    for share, rate in ((0.2, 0.0), (0.5, 0.3), (0.9, -0.2)):
        at = jnp.asarray(start + share * stroke), jnp.asarray(rate * stroke)
        found = jax.grad(equation.resistance, argnums=(0, 1))(*at)
        for k, slope in enumerate(found):
            ahead, behind = (
                float(load.resistance(at[0] + move * (k == 0), at[1] + move * (k == 1), {})) for move in (step, -step)
            )
            assert float(slope) == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6, abs=1e-6)


def test_closed_forms_of_the_dead_weight_and_the_bias_spring() -> None:
    at = jnp.asarray(4e-3), jnp.asarray(0.01)
    weight, slider = dead_weight(), bias_spring()
    hanging, sprung = equation_of(HANGING), equation_of(SPRING)
    assert float(hanging.lever()) == float(sprung.lever()) == 1.0
    assert float(hanging.resistance(*at)) == pytest.approx(0.075 * 9.81 + 20.0 * 0.01, rel=1e-12)
    assert float(sprung.resistance(*at)) == pytest.approx(8.0 + 60.0 * 4e-3 + 20.0 * 0.01, rel=1e-12)
    assert (float(hanging.inertia()), float(sprung.inertia())) == (float(weight.load_mass), float(slider.slider_mass))
    # All of the recoverable strain, where no stop ends the way.
    assert float(stroke_of(SPRING)) == pytest.approx(0.02 * 0.96)
    assert float(stroke_of(ARM)) == pytest.approx(0.043 * 0.9 / (2.0 * 8.25e-3))


def test_the_acceleration_of_the_plant_is_what_the_equation_says() -> None:
    """The simulator's own step, at a stress and a speed: (lever A sigma - h)/I, of a user's load as well."""
    from smajax.simulation.simulate import simulate

    run = simulate(OWN, {"voltage": jnp.full(401, 5.0)}, 5e-4)
    equation = equation_of(OWN)
    pull = np.asarray(run.stress) * float(force_per_stress(OWN))
    held = np.asarray(jax.vmap(equation.resistance)(run.position, run.velocity))
    predicted = (pull - held) / float(equation.inertia())
    # By central differences of the velocity, where the load moves.
    measured = np.gradient(np.asarray(run.velocity), 5e-4)
    moving = np.abs(np.asarray(run.velocity)) > 1e-3
    assert moving.sum() > 20
    assert np.abs(predicted[moving] - measured[moving]).max() < 0.02 * np.abs(pull).max() / float(equation.inertia())


def test_forces_that_effects_add_are_part_of_the_resistance() -> None:
    wider = extended(SPRING, ("nonlinear_spring", "viscous_friction"), {"viscous_friction.coefficient": 5.0})
    at = jnp.asarray(4e-3), jnp.asarray(0.01)
    plain, more = (float(equation_of(one).resistance(*at)) for one in (SPRING, wider))
    assert more - plain == pytest.approx(5.0 * 0.01, rel=1e-9)
    assert isinstance(quick_stress_sliding(wider).equation, LoadEquation)
    assert float(quick_stress_sliding(wider).equation.resistance(*at)) == more


def test_what_a_load_does_not_give_is_named() -> None:
    assert missing_for_equation(OWN) == ""
    scheduled = dataclasses.replace(HANGING, load=Scheduled())
    assert "needs the input mass" in missing_for_equation(scheduled)
    weightless = dataclasses.replace(HANGING, load=dataclasses.replace(Lever(), mass=jnp.asarray(0.0)))
    assert "its inertia is 0" in missing_for_equation(weightless)

    class Rough(Lever):
        def resistance(self, position, velocity, inputs):
            return self.preload + 0.5 * jnp.sign(velocity) * jnp.sqrt(jnp.abs(velocity))

    assert "the derivative of its resistance is nan" in missing_for_equation(dataclasses.replace(HANGING, load=Rough()))
