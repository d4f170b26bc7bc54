"""Backstepping does what its derivation says, on the simulated arm; the wire read backwards is the wire."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.backstepping_two import BacksteppingTwo
from smajax.control.controllers.inverse_wire import (
    bounded_arccos,
    fraction_for,
    strain_at_angle,
    stress_slopes,
    temperature_for,
)
from smajax.control.load_equation import force_per_stress
from smajax.control.measured_state import MeasuredState
from smajax.control.presets import backstepping_one, backstepping_two
from smajax.control.reference import Reference, resting
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.load.arm import Arm
from smajax.model.wire.kinetics import austenite_left, martensite_left
from smajax.model.wire.kinetics_terms import NO_TERMS
from studies.source.backstepping_runs import on_heating_curve, plant, stacked
from tests.helpers.machine_code import by_machine_code

PLANT = plant()
ONE, TWO = backstepping_one(PLANT), backstepping_two(PLANT)
LAW = PLANT.wire.kinetics
COUNT = 201
DEGREE = math.pi / 180.0
SETTINGS = settings(max_examples=60, deadline=None)


@by_machine_code
def _loop(controller: Any, wanted: Reference, dt: Any, start: Any) -> ClosedLoop:
    """`dt` differs from run to run, so that one compilation serves every step."""
    return simulate_closed_loop(PLANT, controller, wanted, dt, initial=start)


def batch(controllers: list[Any], targets: list[Any], steps: list[float], starts: list[tuple[float, float]]) -> Any:
    """Set points (degrees) or references; starts on the heating curve: (degrees, rad/s)."""
    wanted = [one if isinstance(one, Reference) else resting(jnp.full(COUNT, one * DEGREE)) for one in targets]
    states = [on_heating_curve(PLANT, jnp.asarray(angle * DEGREE), jnp.asarray(rate)) for angle, rate in starts]
    loops = [
        _loop(*jax.tree.map(lambda leaf: np.asarray(leaf, dtype=float), of))
        for of in zip(controllers, wanted, steps, states, strict=True)
    ]
    return jax.tree.map(lambda *leaves: np.stack(leaves), *loops)


@eqx.filter_jit
def _errors_two(controllers: BacksteppingTwo, measured: MeasuredState, wanted: Reference) -> Any:
    def lane(controller: BacksteppingTwo, measured: MeasuredState, wanted: Reference) -> Any:
        memory = controller.start(jax.tree.map(lambda x: x[0], measured), jax.tree.map(lambda x: x[0], wanted))
        return jax.vmap(lambda m, w: controller.asked(memory, m, w))(measured, wanted)

    return jax.vmap(lane)(controllers, measured, wanted)


STEPS = [4e-3, 2e-3, 1e-3]


@pytest.mark.slow
def test_the_temperature_error_dies_out_at_its_gain_in_the_limit_of_a_small_step() -> None:
    """z' = -K_1 z (eq. 4.79) with the true acceleration; with the wanted one of eq. 4.76 it is faster."""
    gain = 20.0
    exact = set_parameters(TWO, {"temperature_gain": gain, "stress_share": 1.0})
    printed = set_parameters(exact, {"stress_share": 0.0})
    lanes = [exact] * 3 + [printed] * 3
    loops = batch(lanes, [20.0] * 6, STEPS * 2, [(-10.0, 0.0)] * 6)
    assert (loops.voltage[:, :-1] > 0.1).all()
    assert (loops.voltage < float(TWO.largest_voltage)).all()
    asked = _errors_two(stacked(lanes), loops.measured, loops.wanted)
    z = np.asarray(asked.temperature_error)
    assert (np.asarray(asked.heating)[:, :25] == 1.0).all()
    left = [z[k, round(0.1 / step)] / z[k, 0] for k, step in enumerate(STEPS * 2)]
    off = np.abs(np.array(left[:3]) - math.exp(-0.1 * gain))
    assert off[2] < 0.01
    assert off[0] / off[2] > 2.5, f"order one in the step: {off}"
    # What eq. 4.76 leaves out: the stress error accelerates the arm, and c/I - K of it comes on top of K_1.
    load = PLANT.load
    assert isinstance(load, Arm)
    surplus = float(load.damping / load.inertia({}) - TWO.damping_gain)
    rate = -math.log(left[5]) / 0.1
    assert abs(rate - (gain + surplus)) < 0.1 * surplus, rate
    # z_1 = sigma - Phi has the sign of z: (4.86) and with it (4.87) print the other one.
    z_1 = loops.run.stress - np.asarray(asked.stress)
    assert (np.sign(z_1[:3, :25]) == np.sign(z[:3, :25])).all()


def test_the_stress_error_dies_out_at_its_gain_in_the_limit_of_a_small_step() -> None:
    """z_1' = -k_1 z_1 (eq. 4.63, 4.65): the bracket of eq. 4.66 as derived again."""
    gain = 20.0
    lanes = [set_parameters(ONE, {"stress_gain": gain, "measured_rate_share": 0.0})] * 6
    loops = batch(lanes, [20.0] * 6, STEPS * 2, [(-10.0, 0.0)] * 3 + [(0.0, 0.0)] * 3)
    assert (loops.voltage[:, :-1] > 0.1).all()
    assert (loops.voltage < float(ONE.largest_voltage)).all()
    wanted = jax.jit(jax.vmap(jax.vmap(ONE.stress_wanted)))(loops.run.position, loops.run.velocity, loops.wanted)
    z = loops.run.stress - np.asarray(wanted)
    off = [abs(z[k, round(0.1 / step)] / z[k, 0] - math.exp(-0.1 * gain)) for k, step in enumerate(STEPS * 2)]
    for first in (0, 3):
        assert off[first + 2] < 0.02
        assert off[first] / off[first + 2] > 2.5, f"order one in the step: {off}"


@pytest.mark.parametrize(
    "tuned",
    [
        pytest.param(TWO, id="two", marks=pytest.mark.slow),
        pytest.param(set_parameters(ONE, {"measured_rate_share": 0.0}), id="one"),
    ],
)
def test_the_lyapunov_function_falls(tuned: Any) -> None:
    """(x_1^2 + x_2^2)/2 (eq. 4.56), from both sides, once the wire has taken over; and at the rate -K x_2^2."""
    starts = [(0.0, 0.0), (-30.0, 0.0), (10.0, 0.0), (40.0, 0.0), (60.0, 0.0), (30.0, -1.0)]
    loops = batch([tuned] * 6, [20.0] * 6, [0.01] * 6, starts)
    x_1, x_2 = loops.run.position - 20.0 * DEGREE, loops.run.velocity
    level = 0.5 * (x_1**2 + x_2**2)
    # From below the wire heats at once; from above it has to cool through its hysteresis first, with the arm at rest.
    below = level[:3, 20:]
    assert (np.diff(below[:, ::10], axis=1) < 0.0).all()
    spent = level[1, 60] - level[1, 180]
    dissipated = float(tuned.damping_gain) * 0.01 * (x_2[1, 60:180] ** 2).sum()
    assert abs(spent - dissipated) < 0.05 * dissipated
    assert (level[3:, -1] < level[3:, 0]).all()


@pytest.mark.slow
def test_a_moving_set_point_is_followed() -> None:
    """x_2 and the wanted acceleration count in: a ramp leaves an error only of how it begins."""
    time, speed = 0.01 * jnp.arange(COUNT), 0.3
    moving = Reference(-10.0 * DEGREE + speed * time, jnp.full(COUNT, speed), jnp.zeros(COUNT))
    told_less = Reference(moving.position, jnp.zeros(COUNT), jnp.zeros(COUNT))
    loops = batch([TWO] * 6, [moving, told_less] * 3, [0.01] * 6, [(-10.0, speed)] * 6)
    error = np.abs(loops.run.position - np.asarray(moving.position)) / DEGREE
    assert error[0].max() < 2.0
    assert error[1].max() > 8.0


def test_the_inverse_wire_gives_the_fraction_and_temperature_of_the_plant() -> None:
    """Along a run, angle and stress give the fraction (eq. 4.72), and that the temperature (eq. 4.73, 4.74)."""
    loops = batch([TWO] * 6, [40.0, 60.0, 20.0, -20.0, 0.0, 10.0], [0.01] * 6, [(0.0, 0.0)] * 6)
    run = loops.run
    fraction = np.asarray(
        jax.jit(jax.vmap(jax.vmap(lambda at, s: fraction_for(PLANT, at, s))))(run.position, run.stress)
    )
    np.testing.assert_allclose(fraction, run.martensite_fraction, atol=1e-6)
    strain = np.asarray(jax.jit(jax.vmap(jax.vmap(lambda at: strain_at_angle(PLANT, at))))(run.position))
    law = PLANT.wire.constitutive
    modulus = law.young_modulus_austenite + fraction * (law.young_modulus_martensite - law.young_modulus_austenite)
    np.testing.assert_allclose(modulus * (strain - law.recoverable_strain * fraction), run.stress, rtol=1e-6)
    heating = np.diff(run.martensite_fraction, axis=1, append=1.0) < -1e-5
    heating &= np.diff(run.martensite_fraction, axis=1, prepend=1.0) < -1e-5
    assert heating.sum() > 200
    back = jax.jit(
        jax.vmap(lambda xi, s, m, a: temperature_for(LAW, xi, s, jnp.asarray(True), m, a, jnp.asarray(1e-9)))
    )(fraction[heating], run.stress[heating], run.xi_M[heating], run.xi_A[heating])
    np.testing.assert_allclose(np.asarray(back), run.temperature[heating], atol=1e-4)


@jax.jit
def _there_and_back(fraction: Any, stress: Any, share: Any, heating: Any) -> Any:
    """(fraction found again, its derivative by jvp, by central differences)."""
    xi_M = fraction + share * (1.0 - fraction)
    xi_A = share * fraction
    edge = jnp.asarray(1e-9)

    def temperature(fraction: Any) -> Any:
        return temperature_for(LAW, fraction, stress, heating, xi_M, xi_A, edge)

    at = temperature(fraction)
    hot = xi_M * martensite_left(LAW, NO_TERMS, at, stress)
    cold = 1.0 - (1.0 - xi_A) * austenite_left(LAW, NO_TERMS, at, stress)
    small = 1e-6
    central = (temperature(fraction + small) - temperature(fraction - small)) / (2.0 * small)
    return jnp.where(heating, hot, cold), jax.jvp(temperature, (fraction,), (1.0,))[1], central


@SETTINGS
@given(st.floats(0.02, 0.98), st.floats(0.0, 3e8), st.floats(0.1, 0.9), st.booleans())
def test_the_temperature_of_a_fraction_inverts_the_kinetics(
    fraction: float, stress: float, share: float, heating: bool
) -> None:
    again, slope, central = _there_and_back(fraction, stress, share, heating)
    assert abs(float(again) - fraction) < 1e-9
    assert abs(float(slope - central)) < 1e-5 * abs(float(central))
    assert float(slope) < 0.0, "more martensite is colder"


def test_the_slope_of_arccos_is_bounded_as_stated() -> None:
    edge = jnp.asarray(1e-6)
    at = jnp.array([-2.0, -1.0, -1.0 + 1e-9, 0.3, 1.0 - 1e-9, 1.0, 2.0])
    slope = jax.jit(jax.vmap(jax.grad(bounded_arccos), (0, None)))(at, edge)
    assert (jnp.abs(slope) <= 1.0 / jnp.sqrt(2.0 * edge - edge**2) * (1.0 + 1e-9)).all()
    assert (slope[1:6] < 0.0).all(), "no dead end inside of [-1, 1]"
    assert abs(float(bounded_arccos(jnp.asarray(0.3), edge)) - math.acos(0.3)) < 1e-12
    assert abs(float(bounded_arccos(jnp.asarray(1.0), edge))) < float(jnp.sqrt(2.0 * edge))


@jax.jit
def _root(position: Any, stress: Any, ratio: Any) -> Any:
    system = set_parameters(PLANT, {"young_modulus_martensite": ratio * 75e9})
    fraction = fraction_for(system, position, stress)
    law = system.wire.constitutive
    modulus = law.young_modulus_austenite + fraction * (law.young_modulus_martensite - law.young_modulus_austenite)
    there = modulus * (strain_at_angle(system, position) - law.recoverable_strain * fraction)
    slopes = jax.grad(fraction_for, (1, 2))(system, position, stress)
    return fraction, there, slopes, stress_slopes(system, position, fraction)


@SETTINGS
@given(st.floats(-0.8, 1.7), st.floats(0.0, 1e9), st.floats(0.3, 1.0))
def test_the_quadratic_has_its_root_in_the_unit_interval(position: float, stress: float, ratio: float) -> None:
    fraction, there, (by_position, by_stress), (per_fraction, per_radian) = _root(position, stress, ratio)
    assert 0.0 <= float(fraction) <= 1.0
    assert np.isfinite([float(by_position), float(by_stress)]).all()
    if 1e-6 < float(fraction) < 1.0 - 1e-6:
        assert abs(float(there) - stress) < 1e-6 * 75e9 * 0.043
        # Gamma of eq. 4.61: the derivative of the root is that of the law turned round.
        np.testing.assert_allclose(float(by_stress * per_fraction), 1.0, rtol=1e-6)
        np.testing.assert_allclose(float(by_position), float(-per_radian / per_fraction), rtol=1e-6)
    else:
        short = float(there) <= stress + 1.0 if float(fraction) <= 1e-6 else float(there) >= stress - 1.0
        assert short, "at the end that lies nearer"


GAINS = {
    "two": (
        "damping_gain",
        "temperature_gain",
        "edge",
        "inertia_ratio",
        "rest_torque_share",
        "stress_share",
        "epsilon",
    ),
    "one": ("damping_gain", "stress_gain", "edge", "inertia_ratio", "rest_torque_share", "measured_rate_share"),
}


def _voltage(controller: Any, names: tuple[str, ...]) -> Any:
    def of(gains: Any, measured: MeasuredState, target: Any) -> Any:
        tuned = set_parameters(controller, {name: gains[k] for k, name in enumerate(names)})
        wanted = Reference(target, jnp.zeros_like(target), jnp.zeros_like(target))
        memory = jax.lax.stop_gradient(tuned.start(measured, wanted))
        return tuned.step(memory, measured, wanted, jnp.asarray(0.01))[1]

    return jax.jit(jax.value_and_grad(of, (0, 1, 2)))


VOLTAGE = {
    "two": (_voltage(set_parameters(TWO, {"cross_share": -1.0}), GAINS["two"]), get_parameters(TWO, GAINS["two"])),
    "one": (_voltage(ONE, GAINS["one"]), get_parameters(ONE, GAINS["one"])),
}
ENDS = st.sampled_from([0.0, 1.0, 0.5, 1e-12, 1.0 - 1e-12]) | st.floats(0.0, 1.0)


@pytest.mark.slow  # those of runs are below
@SETTINGS
@given(
    which=st.sampled_from(["one", "two"]),
    state=st.builds(
        MeasuredState,
        position=st.floats(-0.8, 1.7),
        velocity=st.sampled_from([0.0]) | st.floats(-20.0, 20.0),
        stress=st.sampled_from([0.0]) | st.floats(0.0, 5e8),
        temperature=st.floats(-20.0, 200.0),
        martensite_fraction=ENDS,
        xi_M=ENDS,
        xi_A=ENDS,
    ),
    target=st.floats(-0.8, 1.7),
)
def test_every_state_has_a_finite_voltage_and_derivatives(which: str, state: MeasuredState, target: float) -> None:
    evaluate, gains = VOLTAGE[which]
    measured = jax.tree.map(jnp.asarray, state)
    voltage, slopes = evaluate(gains, measured, jnp.asarray(target))
    assert 0.0 <= float(voltage) <= float(TWO.largest_voltage)
    for leaf in jax.tree.leaves(slopes):
        assert np.isfinite(np.asarray(leaf)).all(), slopes


def test_derivatives_in_the_gains_agree_with_differences_of_runs() -> None:
    """Along the whole loop, the voltage inside its limits and on one curve: against central differences."""
    start = on_heating_curve(PLANT, jnp.asarray(-0.2), jnp.zeros(()))
    names = ("damping_gain", "temperature_gain")

    def end(gains: Any) -> Any:
        tuned = set_parameters(TWO, {name: gains[k] for k, name in enumerate(names)})
        loop = simulate_closed_loop(PLANT, tuned, jnp.full(41, 20.0 * DEGREE), 0.01, initial=start)
        return loop.run.position[-1]

    # One compilation gives the value and the slope in any direction.
    along = by_machine_code(lambda gains, direction: jax.jvp(end, (gains,), (direction,)))
    at = jnp.array([1.7, 20.0])
    for k, small in enumerate((1e-4, 1e-3)):
        direction = jnp.eye(2)[k]
        slope = float(along(at, direction)[1])
        more, less = (along(at + sign * small * direction, direction)[0] for sign in (1.0, -1.0))
        central = float(more - less) / (2.0 * small)
        assert abs(slope - central) < 1e-4 * abs(central) + 1e-9, (names[k], slope, central)


def test_without_h_0_the_set_point_is_held_and_with_h_0_the_arm_falls() -> None:
    """Eq. 4.70's h_0 makes the stress zero where the arm's weight is to be held."""
    target = jnp.asarray(0.3)
    wanted = Reference(target, jnp.zeros(()), jnp.zeros(()))
    load = PLANT.load
    assert isinstance(load, Arm)
    held = load.resistance(target, jnp.zeros(()), {}) / force_per_stress(PLANT)
    for tuned in (ONE, TWO):
        np.testing.assert_allclose(tuned.stress_wanted(target, jnp.zeros(()), wanted), held)
        printed = set_parameters(tuned, {"rest_torque_share": 1.0})
        assert float(printed.stress_wanted(target, jnp.zeros(()), wanted)) == 0.0
