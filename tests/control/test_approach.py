"""The speed of an approach: a line near the set point, a parabola of a constant deceleration beyond, and by default the law of the source."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.controllers.approach import LINE, approach_speed
from smajax.control.measured_state import MeasuredState
from smajax.control.presets import CONTROLLERS
from smajax.control.reference import Reference
from smajax.core.parameters import parameters, set_parameters
from smajax.model.rigs import arm
from tests.helpers.often import often

RATE, BRAKING = 10.0, 20.0  # 1/s, rad/s^2: the line ends at 0.2 rad
OFF = jnp.linspace(-2.0, 2.0, 401)
speed = jax.vmap(lambda off, braking: approach_speed(off, RATE, braking), (0, None))
slope = jax.vmap(jax.grad(approach_speed), (0, None, None))
STILL = Reference(jnp.asarray(0.6), jnp.zeros(()), jnp.zeros(()))


def _measured(position: float, velocity: float) -> MeasuredState:
    return MeasuredState(*map(jnp.asarray, (position, velocity, 1.2e8, 85.0, 0.5, 1.0, 0.0)))


def test_led_along_it_a_load_is_never_slowed_down_by_more() -> None:
    """x' = -f(x), so x'' = f'(x) f(x)."""
    slowed = np.abs(slope(OFF, RATE, BRAKING) * speed(OFF, BRAKING))
    assert slowed.max() <= BRAKING * (1.0 + 1e-12)
    np.testing.assert_allclose(slowed[np.abs(OFF) > 0.21], BRAKING, rtol=1e-12)
    assert np.abs(RATE**2 * OFF).max() > 5.0 * BRAKING  # which the line would ask for


def test_line_and_parabola_meet_with_one_slope() -> None:
    edge = BRAKING / RATE**2
    inside, outside = jnp.asarray([edge - 1e-9, edge + 1e-9])
    assert approach_speed(outside, RATE, BRAKING) == pytest.approx(
        float(approach_speed(inside, RATE, BRAKING)), rel=1e-7
    )
    sides = slope(jnp.stack([inside, outside]), RATE, BRAKING)
    assert float(sides[0]) == pytest.approx(float(sides[1]), rel=1e-6)
    assert (jnp.diff(speed(OFF, BRAKING)) > 0.0).all()
    np.testing.assert_allclose(speed(-OFF, BRAKING), -speed(OFF, BRAKING), rtol=1e-12)


def test_by_default_it_is_the_line_and_a_rate_of_zero_asks_for_nothing() -> None:
    np.testing.assert_array_equal(speed(OFF, LINE), RATE * OFF)
    assert float(approach_speed(jnp.asarray(1.5), jnp.zeros(()), LINE)) == 0.0
    assert np.isfinite(jax.grad(approach_speed, (0, 1))(jnp.asarray(1.5), jnp.zeros(()), LINE)).all()


def test_backstepping_without_it_asks_for_the_printed_pull_with_any_damping() -> None:
    for damping in (0.0, 29.0):
        controller = set_parameters(CONTROLLERS["backstepping1_integral"].make(arm()), {"damping_gain": damping})
        pull = controller._pull(jnp.asarray(0.4), jnp.asarray(1.1), STILL)
        assert float(pull) == pytest.approx(80.0 * (0.4 - 0.6) + damping * 1.1, rel=1e-12)


def test_sliding_control_without_it_has_the_surface_of_the_source() -> None:
    controller = CONTROLLERS["sld"].make(arm())
    error, rate = 0.02 - 0.6, 1.1
    area, slopes = float(controller.cross_section), float(controller.surface_slope)
    surface = np.clip((rate + slopes * error) / float(controller.boundary), -1.0, 1.0)
    equation = controller.equation
    torque = float(equation.resistance(jnp.asarray(0.02), jnp.asarray(rate)) - equation.inertia() * slopes * rate)
    expected = (torque - float(controller.gain) * surface) / (float(equation.lever()) * area)
    assert float(controller.stress_wanted(_measured(0.02, rate), STILL)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    "name", often(["backstepping1_integral", "sld", "feedforward_pi"], ["backstepping1_integral", "sld"])
)
def test_with_it_a_controller_asks_for_less_far_away_and_for_the_same_near(name: str) -> None:
    made = CONTROLLERS[name].make(arm())
    assert parameters(made)["braking"].unit == "rad/s^2"
    braked = set_parameters(made, {"braking": 1.0})
    step = jax.jit(lambda one, measured: one.step(one.start(measured, STILL), measured, STILL, jnp.asarray(0.01)))
    far, near = _measured(-0.7, 2.0), _measured(0.599, 0.0)
    changes = [
        any(bool(jnp.abs(one - other) > 1e-9) for one, other in zip(*map(jax.tree.leaves, pair), strict=True))
        for pair in ((step(made, here), step(braked, here)) for here in (far, near))
    ]
    assert changes == [True, False]
