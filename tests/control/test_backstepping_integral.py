"""Backstepping with a weight of the position and integrals: the printed law is untouched, and wrong plants end on their set point."""

from __future__ import annotations

import dataclasses
import itertools
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from smajax.control.controllers.backstepping_one import BacksteppingOne
from smajax.control.controllers.backstepping_two import BacksteppingTwo
from smajax.control.controllers.position_integral import next_integral
from smajax.control.load_equation import equation_of, force_per_stress
from smajax.control.measured_state import truth
from smajax.control.presets import CONTROLLERS, with_printed_law
from smajax.control.reference import Reference
from smajax.control.sweep.batched_loops import LoopSetup, Outcome, closed_loops
from smajax.control.sweep.grid import loop_rows
from smajax.core.parameters import set_parameters
from smajax.model.rigs import arm
from smajax.model.system import initial_state
from tests.helpers.often import often

PRINTED, INTEGRAL = ("backstepping1", "backstepping2"), ("backstepping1_integral", "backstepping2_integral")
CORNERS = [(1.0, 1.0, 1.0), *itertools.product((0.8, 1.2), repeat=3)]  # inertia, damping, convection
SET_POINTS = (-30.0, 0.0, 40.0, 75.0)  # degrees
ZERO = jnp.zeros(())


def still(position: float) -> Reference:
    return Reference(jnp.asarray(position), ZERO, ZERO)


@cache
def perturbed(name: str, payload: float = 1.0) -> Outcome:
    """36 loops on the true state: nine plants at four set points."""
    preset = CONTROLLERS[name]
    plant = preset.plant(arm())
    plants = np.repeat(CORNERS, len(SET_POINTS), axis=0)
    named = dict(zip(("inertia", "damping", "convection"), plants.T, strict=True))
    rows = loop_rows(named | {"payload": np.full(len(plants), payload)}, np.radians(SET_POINTS * len(CORNERS)))
    return closed_loops(LoopSetup(plant, preset.make(plant), preset.main_gain), rows)


@pytest.mark.parametrize("name", PRINTED)
def test_the_printed_law_leaves_wrong_plants_off_their_set_points(name: str) -> None:
    merits = perturbed(name).merits
    assert np.isfinite(merits.settling_time).sum() <= 6
    assert np.degrees(merits.steady_error).max() > 80.0


@pytest.mark.parametrize("name", INTEGRAL)
def test_with_weight_and_integrals_all_wrong_plants_meet_the_requirement(name: str) -> None:
    """Inertia, damping and convection each 20 % wrong: within 4 s, 2 degrees and 0.5 degrees."""
    merits = perturbed(name).merits
    assert merits.settling_time.max() < 4.0
    assert np.degrees(merits.overshoot).max() < 2.0
    assert np.degrees(merits.steady_error).max() < 0.5


@pytest.mark.parametrize("name", INTEGRAL)
def test_a_payload_that_is_wrong_as_well_leaves_no_error(name: str) -> None:
    """20 % of weight are 25 MPa, which the outer integral takes over."""
    merits = perturbed(name, 1.2).merits
    assert np.isfinite(merits.settling_time).all()
    assert np.degrees(merits.steady_error).max() < 0.5


def test_the_printed_weight_of_the_position_is_a_twentieth_of_a_degree_of_wire_temperature() -> None:
    controller = CONTROLLERS["backstepping2"].make(with_printed_law(arm()))
    assert isinstance(controller, BacksteppingTwo)
    off, none = (
        set_parameters(controller, {"position_gain": weight}).stress_wanted(jnp.asarray(0.5), ZERO, still(1.5))
        for weight in (1.0, 0.0)
    )
    per_kelvin = controller.believed.wire.kinetics.stress_slope_austenite
    assert float((off - none) / per_kelvin) == pytest.approx(0.047, abs=0.001)


@pytest.mark.parametrize("name", often(PRINTED, ["backstepping2"]))
def test_integrals_that_have_no_weight_change_no_command(name: str) -> None:
    """As printed whatever they have summed up; with a weight the same sums change it."""
    plant = with_printed_law(arm())
    controller = CONTROLLERS[name].make(plant)
    measured = truth(initial_state(plant, plant.drive.from_command(ZERO)))
    assert isinstance(controller, BacksteppingOne | BacksteppingTwo)
    begun = controller.start(measured, still(0.0))
    full = dataclasses.replace(begun, integral=jnp.asarray(3.0), inner_integral=jnp.asarray(-2.0))

    def power(controller: BacksteppingOne | BacksteppingTwo, memory: Any) -> float:
        if isinstance(controller, BacksteppingOne):
            return float(controller.asked(memory, measured, still(-0.75), jnp.asarray(0.01)).power)
        return float(controller.asked(memory, measured, still(-0.75)).power)

    assert power(controller, begun) == power(controller, full)
    weighed = set_parameters(controller, {"integral_rate": 1.0})
    assert power(weighed, begun) != power(weighed, full)


@pytest.mark.parametrize(
    ("damping", "weight", "time"), [(1.0, 4.0, 2.0), (1.0, 4.0, 0.6), (3.0, 50.0, 0.2), (29.0, 80.0, 0.14)]
)
def test_the_motion_asked_for_is_stable_where_routh_says_so_and_then_has_a_lyapunov_function(
    damping: float, weight: float, time: float
) -> None:
    """The chain (w_0, x_1, x_2) as the controller's own stress makes it: K T_i + K^2/K_0 > 1."""
    controller = CONTROLLERS["backstepping1_integral"].make(arm())
    assert isinstance(controller, BacksteppingOne)
    gains = {"damping_gain": damping, "position_gain": weight, "integral_rate": 1.0 / time}
    controller = set_parameters(controller, gains)
    equation, believed = equation_of(controller.believed), controller.believed

    def rates(chain: jax.Array) -> jax.Array:
        summed, off, rate = chain
        position, wanted = 0.2 + off, still(0.2)
        stress = controller.stress_wanted(position, rate, wanted, summed)
        force = force_per_stress(believed) * stress - equation.resistance(position, rate)
        return jnp.stack([weight * off + damping * rate, rate, force / equation.inertia()])

    matrix = np.asarray(jax.jit(jax.jacfwd(rates))(jnp.zeros(3)))
    stable = bool(np.linalg.eigvals(matrix).real.max() < 0.0)
    assert stable == (damping * time + damping**2 / weight > 1.0)
    function = solve_continuous_lyapunov(matrix.T, -np.eye(3))
    assert bool(np.linalg.eigvalsh(0.5 * (function + function.T)).min() > 0.0) == stable


@pytest.mark.parametrize(
    ("voltage", "error", "waits"),
    [(8.0, -1.0, True), (8.0, 1.0, False), (0.0, 1.0, True), (0.0, -1.0, False), (4.0, 1.0, False)],
)
def test_the_integral_waits_where_the_command_can_not_follow(voltage: float, error: float, waits: bool) -> None:
    after = next_integral(
        jnp.asarray(2.0), jnp.asarray(error), jnp.asarray(0.01), jnp.asarray(voltage), jnp.asarray(8.0)
    )
    assert float(after) == pytest.approx(2.0 if waits else 2.0 + 0.01 * error)
