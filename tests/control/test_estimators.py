"""Filters: the shared update against textbook ones, the model's own against chi-square, both against the true run."""

from __future__ import annotations

import dataclasses
from functools import cache

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are
from scipy.stats import chi2

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.estimators.believed_state import advanced, vector_of, with_correction, with_vector
from smajax.control.estimators.kalman import AbstractPrediction, Belief, Innovation, Linearised, corrected
from smajax.control.estimators.printed_filter import PastCarried, PastDropped
from smajax.control.estimators.run import estimate
from smajax.control.estimators.unscented import Unscented
from smajax.control.measured_state import Sensor
from smajax.control.presets import model_filter, printed_filter, stress_sliding
from smajax.core.parameters import get_parameters, set_parameters, set_vector
from smajax.engine import program
from smajax.model.rigs import arm, coupon, dead_weight
from smajax.model.system import initial_state
from smajax.model.types import Motion, State, Trajectory
from smajax.model.wire.branch_amplitude import UNKNOWN, AsPrinted
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import simulate
from tests.helpers.machine_code import by_machine_code

PERIOD, COUNT, NOISE = 0.01, 450, 1e-3
ARM = arm()
# 8 V for 3 s, then none: up through the whole range, and most of the way down.
VOLTS = np.where(np.arange(COUNT) * PERIOD < 2.995, 8.0, 0.0)
MODEL, PRINTED = model_filter(ARM), printed_filter(ARM)

followed = by_machine_code(lambda estimator, readings, volts: estimate(estimator, readings, volts, PERIOD))


# Not of the module: each worker would simulate it, whoever runs these tests.
@cache
def truth() -> Trajectory:
    return simulate_compiled(ARM, {"voltage": jnp.asarray(VOLTS)}, PERIOD)


@cache
def measured() -> jax.Array:
    return jnp.asarray(truth().position) + NOISE * jax.random.normal(jax.random.key(1), (COUNT,))


def _rms(one, other, here=slice(None)):
    return float(jnp.sqrt(jnp.mean((one - other)[here] ** 2)))


LINEAR = np.array([[1.0, 0.1, 0.0], [-0.3, 0.9, 0.2], [0.0, 0.1, 0.7]])
SEEN, Q, R = np.array([1.0, 0.0, 0.5]), np.diag([1e-3, 2e-2, 5e-3]), 0.04


@pytest.mark.parametrize("prediction", [Linearised(), Unscented()], ids=["extended", "unscented"])
def test_on_a_linear_system_both_filters_equal_the_kalman_filter(prediction: AbstractPrediction) -> None:
    """Against the textbook's (I - K H) P in numpy, and against the steady gain of the Riccati equation."""
    rng = np.random.default_rng(3)
    mean, covariance = np.array([0.2, -0.1, 0.4]), np.diag([1.0, 0.5, 2.0])
    belief = Belief(jnp.asarray(mean), jnp.asarray(covariance))

    @jax.jit
    def after(belief: Belief, reading: jax.Array) -> tuple[Belief, Innovation]:
        belief, _ = prediction.predicted(lambda x: (jnp.asarray(LINEAR) @ x, None), belief, jnp.asarray(Q))
        return corrected(belief, reading, jnp.asarray(SEEN), jnp.asarray(R))

    for reading in rng.standard_normal(60):
        belief, innovation = after(belief, jnp.asarray(reading))
        mean, covariance = LINEAR @ mean, LINEAR @ covariance @ LINEAR.T + Q
        variance = SEEN @ covariance @ SEEN + R
        gain, off = covariance @ SEEN / variance, reading - SEEN @ mean
        mean, covariance = mean + gain * off, (np.eye(3) - np.outer(gain, SEEN)) @ covariance
        # The unscented root is taken with a share of each variance added, so that it exists.
        tolerance = 1e-12 if isinstance(prediction, Linearised) else 1e-9
        np.testing.assert_allclose(belief.mean, mean, rtol=tolerance, atol=tolerance)
        np.testing.assert_allclose(belief.covariance, covariance, rtol=tolerance, atol=tolerance)
        np.testing.assert_allclose([innovation.value, innovation.variance], [off, variance], rtol=1e-8, atol=tolerance)
    steady = solve_discrete_are(LINEAR.T, SEEN[:, None], Q, np.array([[R]]))
    np.testing.assert_allclose(gain, steady @ SEEN / (SEEN @ steady @ SEEN + R), rtol=1e-6)


# An arm that is clear of its stops: against a stop an error is cut off, and no filter's normal distribution holds.
CLEAR = set_parameters(
    dataclasses.replace(MODEL, system=set_parameters(ARM, {"lower_stop": -1.2, "upper_stop": 2.2})),
    {
        "position_walk": 1e-4,
        "velocity_walk": 0.05,
        "temperature_walk": 0.3,
        "fraction_walk": 1e-3,
        "start_temperature_error": 1.0,
        "start_fraction_error": 0.0,
    },
)


@eqx.filter_jit
def _experiments(model, believed_noise, keys):
    """Runs with the noise that `model` believes in -> (squared normalised innovations, normalised errors)."""
    volts = jnp.where(jnp.arange(COUNT) * PERIOD < 2.995, 7.6, 0.0)
    walks = [model.position_walk, model.velocity_walk, model.temperature_walk, model.fraction_walk]
    starts = [model.start_position_error, model.start_velocity_error, model.start_temperature_error]
    starting = jnp.stack([*starts, model.start_fraction_error])

    def one(key):
        first, walking, reading = jax.random.split(key, 3)
        rest = initial_state(model.system, {"voltage": jnp.zeros(())})
        state = with_vector(model.system, rest, vector_of(rest) + starting * jax.random.normal(first, (4,)))

        def body(state, now):
            after = advanced(model.system, state, now[0], jnp.asarray(PERIOD), 1)
            pushed = vector_of(after) + jnp.stack(walks) * jnp.sqrt(PERIOD) * now[1]
            after = with_vector(model.system, after, pushed)
            return after, vector_of(after)

        _, rows = jax.lax.scan(body, state, (volts[:-1], jax.random.normal(walking, (COUNT - 1, 4))))
        true = jnp.concatenate([vector_of(state)[None], rows])
        readings = true[:, 0] + model.reading_noise * jax.random.normal(reading, (COUNT,))
        believing = set_parameters(model, {"reading_noise": believed_noise})
        memory, _ = estimate(believing, readings, volts, PERIOD)
        errors = (jax.vmap(vector_of)(memory.state) - true)[1:]
        spread = jnp.sqrt(jnp.diagonal(memory.covariance, axis1=1, axis2=2))[1:]
        return memory.innovation.value**2 / memory.innovation.variance, errors / spread

    return jax.vmap(one)(keys)


@pytest.mark.slow
def test_innovations_and_errors_are_as_large_as_the_model_filter_believes() -> None:
    """32 runs up and down: each run's sum of squared innovations in its 95 % band, and so each moment's."""
    keys, noise = jax.random.split(jax.random.key(0), 32), CLEAR.reading_noise
    squares, errors = (np.asarray(array) for array in _experiments(CLEAR, noise, keys))
    low, high = chi2.ppf([0.025, 0.975], COUNT)
    inside = (squares.sum(axis=1) > low) & (squares.sum(axis=1) < high)
    assert inside.mean() > 0.83  # 95 % less three standard errors of 32 runs
    low, high = chi2.ppf([0.025, 0.975], len(keys))
    assert ((squares.sum(axis=0) > low) & (squares.sum(axis=0) < high)).mean() > 0.92
    np.testing.assert_allclose(np.sqrt((errors**2).mean(axis=(0, 1))), 1.0, atol=0.15)
    # The test can fail: a filter that believes in 1.3 times the noise is found out.
    squares, _ = _experiments(CLEAR, 1.3 * noise, keys)
    assert (np.asarray(squares).sum(axis=1) < chi2.ppf(0.025, COUNT)).mean() > 0.9


def test_a_wrong_start_temperature_is_corrected_faster_than_the_wire_forgets_it() -> None:
    believed = set_parameters(MODEL, {"start_temperature": 35.0, "start_temperature_error": 15.0})
    memory, told = followed(believed, measured(), VOLTS)
    heat, wire = ARM.wire.heat, ARM.wire
    forgets = heat.density * wire.wire_diameter * heat.specific_heat / (4.0 * heat.convection_coefficient)
    off = np.abs(told.temperature - truth().temperature)
    at = round(0.5 / PERIOD)
    assert off[0] == pytest.approx(15.0, abs=0.1)
    assert off[at] < 2.0 < 0.25 * 15.0 * np.exp(-0.5 / forgets)
    assert off[at] < 4.0 * np.sqrt(memory.covariance[at, 2, 2])


@pytest.mark.slow
def test_at_a_stop_the_unscented_filter_corrects_what_the_linearised_one_cannot() -> None:
    """The believed arm rests on its stop, where the derivative is zero and only points on the other side move."""
    believed = set_parameters(MODEL, {"start_temperature": 5.0, "start_temperature_error": 15.0})
    extended, unscented = (
        _rms(
            followed(dataclasses.replace(believed, prediction=one), measured(), VOLTS)[1].temperature,
            truth().temperature,
        )
        for one in (Linearised(), Unscented())
    )
    assert unscented < 0.6 * extended


@pytest.mark.slow
def test_the_estimator_study_runs_in_its_fast_setting() -> None:
    from studies.estimators import main

    table = main(fast=True)
    noisy = {jacobian: table[f"printed, {jacobian}, R = 0.01, noisy"] for jacobian in ("PastCarried", "PastDropped")}
    # Carrying the sample before the last makes the stress calmer, at the price of a later rate.
    assert noisy["PastCarried"]["stress"] < noisy["PastDropped"]["stress"]
    assert noisy["PastCarried"]["velocity"] > noisy["PastDropped"]["velocity"]
    for plant in ("as believed", "A_s, A_f - 2 C"):
        assert 0.5 < table[f"extended, {plant}, walks x 1"]["innovation"] < 1.5


def test_the_model_filter_follows_every_state() -> None:
    _, told = followed(MODEL, measured(), VOLTS)
    assert _rms(told.position, truth().position) < 0.8 * NOISE
    assert _rms(told.velocity, truth().velocity) < 0.05
    assert _rms(told.stress, truth().stress) < 1.5e6
    assert _rms(told.temperature, truth().temperature) < 0.5
    assert _rms(told.martensite_fraction, truth().martensite_fraction) < 2e-3


@pytest.mark.slow
def test_two_substeps_follow_a_plant_of_half_the_step() -> None:
    fine = simulate_compiled(ARM, {"voltage": jnp.repeat(VOLTS, 2)}, PERIOD / 2).position[::2]
    errors = []
    for substeps in (1, 2):
        tight = dataclasses.replace(MODEL, substeps=substeps)
        memory, _ = followed(tight, fine, VOLTS)
        errors.append(float(jnp.abs(memory.innovation.value[1:]).max()))
    assert errors[1] < 1e-8 < 1e-5 < errors[0]


def test_the_printed_filter_follows_angle_rate_stress_and_temperature_on_the_way_up() -> None:
    """And, away from noise, to within what its backward differences lag; R, not printed, only filters noise."""
    rising = slice(20, 280)
    for readings, stress in ((truth().position, 1e6), (measured(), 8e6)):
        _, told = followed(PRINTED, readings, VOLTS)
        assert _rms(told.position, truth().position, rising) < np.radians(0.1)
        assert _rms(told.velocity, truth().velocity, rising) < 0.12
        assert _rms(told.stress, truth().stress, rising) < stress
        assert _rms(told.temperature, truth().temperature, rising) < 0.2
    # The first guess is the printed one (eq. 4.32), 23 MPa off, and is gone after two samples.
    assert float(told.stress[0]) == pytest.approx(98.1e6)
    assert abs(float(told.stress[3] - truth().stress[3])) < 15e6


def test_the_jacobians_of_the_printed_filter_agree_with_differences_and_with_its_equations() -> None:
    """The whole one against differences, and the printed one against eq. 4.29 and 4.30 worked out by hand."""
    at, period, volts = jnp.asarray([0.3, 0.7, 120.0, 50.0, 0.29, 0.6]), jnp.asarray(PERIOD), jnp.asarray(8.0)
    memory, _ = PRINTED.start(jnp.asarray(0.3))
    transition = jax.jit(lambda vector: PRINTED.transition(vector, memory.coupon, volts, period))
    whole, printed = (np.asarray(one.of(ARM, transition, at, period, 0.0)) for one in (PastCarried(), PastDropped()))
    for column, step in enumerate(1e-6 * np.eye(6)):
        difference = (transition(at + step) - transition(at - step)) / 2e-6
        np.testing.assert_allclose(whole[:, column], difference, rtol=1e-6, atol=1e-6)
    load, heat, area = ARM.load, ARM.wire.heat, 0.25 * np.pi * 150e-6**2
    gravity = (load.payload_mass + 0.5 * load.link_mass) * 9.81 * load.arm_length
    angle = 0.3 + PERIOD * 0.7
    along_angle = -gravity * np.sin(angle) + load.spring_stiffness * load.spring_lever**2
    per_torque = 1e-6 / (2.0 * load.pulley_radius * area)
    by_hand = np.zeros((6, 6))
    by_hand[0, :2], by_hand[1, 0] = (1.0, PERIOD), 1.0 / PERIOD
    by_hand[2, :2] = along_angle * per_torque, load.damping * per_torque
    by_hand[3, 3] = 1.0 - PERIOD * 150.0 * np.pi * 150e-6 / (heat.density * area * heat.specific_heat)
    np.testing.assert_allclose(printed, by_hand, rtol=1e-9)
    assert whole[1, 4] == pytest.approx(-1.0 / PERIOD)


def test_a_corrected_fraction_does_not_jump_back() -> None:
    """On a branch the curve is laid anew; a curve on which the wire turned back stays where it was."""
    state = initial_state(ARM, ARM.drive.from_command(jnp.asarray(8.0)))

    @by_machine_code
    def heated(state, volts, period, count):
        return jax.lax.fori_loop(0, count, lambda _, state: advanced(ARM, state, volts, period, 1), state)

    moving = heated(state, 8.0, PERIOD, 230)
    assert 0.6 < float(moving.wire.martensite_fraction) < 0.7
    for change in (-0.02, 0.02):
        wanted = vector_of(moving).at[3].add(change)
        kept = heated(with_correction(ARM, moving, wanted, jnp.asarray(True)), 8.0, 1e-6, 1)
        assert float(kept.wire.martensite_fraction) == pytest.approx(float(wanted[3]), abs=1e-4)
    lost = heated(with_vector(ARM, moving, vector_of(moving).at[3].add(0.02)), 8.0, 1e-6, 1)
    assert float(lost.wire.martensite_fraction) < float(moving.wire.martensite_fraction) + 0.015
    cooled = heated(moving, 0.0, PERIOD, 10)
    same = with_correction(ARM, cooled, vector_of(cooled), jnp.asarray(False))
    for one, other in zip(jax.tree.leaves(same), jax.tree.leaves(cooled), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)
    printed = dataclasses.replace(ARM.wire, kinetics=dataclasses.replace(ARM.wire.kinetics, renewal=AsPrinted()))
    after = with_correction(
        dataclasses.replace(ARM, wire=printed), moving, vector_of(moving).at[3].add(0.02), jnp.asarray(True)
    )
    assert float(after.wire.xi_M) == float(moving.wire.xi_M)


def test_a_steep_fall_of_the_fraction_stays_in_its_bounds() -> None:
    """A curve laid with nothing of its range left falls in 1e-4 C; the step's second derivative must not lead its value."""
    rest = initial_state(ARM, {"voltage": jnp.zeros(())})
    wire = dataclasses.replace(
        rest.wire,
        **{
            "temperature": jnp.asarray(48.627646898915096),
            "stress": jnp.asarray(60075109.727368176),
            "strain": jnp.asarray(-0.003067075053619783),
            "martensite_fraction": jnp.asarray(0.9223526650511709),
            "xi_M": jnp.asarray(0.9223526650511709),
            "xi_A": jnp.asarray(-117435760.39940292),
            "cooling_missed": jnp.asarray(UNKNOWN),
            "detwinned_fraction": jnp.asarray(0.9223526650511709),
        },
    )
    motion = Motion(jnp.asarray(-0.6181031604727328), jnp.asarray(-6.989864112333557))
    state = dataclasses.replace(rest, wire=wire, motion=motion)

    def ended(state: State, own: dict[str, jax.Array]) -> State:
        return advanced(ARM, state, jnp.zeros(()), own["span"], 1)

    after = program(ended, state, ("span",), engine="native")(state, {"span": np.linspace(0.0099, 0.0101, 101)}, 1)
    assert float(after.wire.stress.max()) < 200e6
    assert float(after.motion.position.max()) < -0.6


@settings(max_examples=12, deadline=None)
@given(
    levels=st.lists(st.floats(0.0, 12.0), min_size=5, max_size=5),
    noise=st.sampled_from([0.0, 1e-3, 0.05, 1.0]),
    seed=st.integers(0, 2**16),
)
def test_any_voltage_and_any_reading_leave_the_fraction_in_its_bounds(levels, noise, seed) -> None:
    volts = jnp.repeat(jnp.asarray(levels), COUNT // 5)
    readings = truth().position + noise * jax.random.normal(jax.random.key(seed), (COUNT,))
    for estimator in (MODEL, PRINTED):
        memory, told = followed(estimator, readings, volts)
        assert all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves((memory, told)))
        assert float(told.martensite_fraction.min()) >= 0.0
        assert float(told.martensite_fraction.max()) <= 1.0
        covariance = memory.covariance if estimator is MODEL else memory.belief.covariance
        assert float(jnp.linalg.eigvalsh(covariance).min()) > -1e-9
        assert float(memory.innovation.variance.min()) > 0.0


@pytest.mark.slow
def test_float32_follows_float64() -> None:
    for estimator, limits in ((MODEL, (1e-4, 2e5, 0.05)), (PRINTED, (1e-4, 2e6, 0.05))):
        _, double = followed(estimator, measured(), VOLTS)
        with jax.enable_x64(False):
            narrow = jax.tree.map(
                lambda leaf: leaf.astype(jnp.float32) if eqx.is_array(leaf) else leaf, (estimator, measured(), VOLTS)
            )
            _, single = followed(*narrow)
        assert single.position.dtype == jnp.float32
        for name, limit in zip(("position", "stress", "temperature"), limits, strict=True):
            assert _rms(getattr(single, name), getattr(double, name)) < limit, name


@by_machine_code
def _missed(estimator, names, at, direction):
    """How far stress and temperature are missed, and the derivative along `direction`."""
    span, count = 0.05, 70
    volts = jnp.where(jnp.arange(count) < 50, 8.0, 0.0)
    true = simulate(ARM, {"voltage": volts}, span)
    readings = true.position + NOISE * jax.random.normal(jax.random.key(2), (count,))

    def missed(vector):
        _, told = estimate(set_vector(estimator, names, vector), readings, volts, span)
        by_stress = jnp.mean((told.stress - true.stress) ** 2) / 1e12
        return jnp.stack([by_stress, jnp.mean((told.temperature - true.temperature) ** 2)])

    return jax.jvp(missed, (at,), (direction,))


@pytest.mark.parametrize(
    ("estimator", "names"),
    [
        pytest.param(
            MODEL,
            ("temperature_walk", "reading_noise", "convection_coefficient", "austenite_start", "damping"),
            id="model",
        ),
        pytest.param(
            PRINTED,
            ("reading_variance", "process_variance", "convection_coefficient", "damping"),
            id="printed",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_derivatives_in_the_filters_gains_and_model_agree_with_differences(estimator, names) -> None:
    """Those of the model filter's gains pass through the second derivative of the simulator's step."""
    at = get_parameters(estimator, names)
    for index, name in enumerate(names):
        direction = jnp.zeros_like(at).at[index].set(at[index])
        value, slope = _missed(estimator, names, at, direction)
        ahead, behind = (_missed(estimator, names, at + sign * direction, direction)[0] for sign in (1e-6, -1e-6))
        difference = (ahead - behind) / 2e-6
        np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-6 * float(jnp.abs(value).max()), err_msg=name)
        assert float(jnp.abs(slope).max()) > 1e-4, f"{name} does nothing"


def test_sliding_control_on_the_estimated_stress_settles() -> None:
    """Sliding control on the filter's stress settles as on the true one; noise on the readings shakes the voltage."""
    target, run = jnp.full(1001, jnp.radians(30.0)), by_machine_code(simulate_closed_loop)
    late, loops = slice(900, None), []
    for noise in (0.0, NOISE):
        sensor, key = Sensor(noise_sigma=noise), jax.random.key(5)
        loops.append(run(ARM, stress_sliding(ARM), target, PERIOD, estimator=PRINTED, sensor=sensor, key=key))
    exact, noisy = loops
    assert _rms(exact.run.position, target, late) < np.radians(0.1)
    assert _rms(exact.measured.stress, exact.run.stress, late) < 1e4
    assert _rms(noisy.measured.position, noisy.run.position) < 2.0 * NOISE
    assert _rms(noisy.measured.stress, noisy.run.stress, late) < 8e6
    assert 0.5 < float(noisy.voltage[late].std()) < 2.0


def test_unsuitable_readings_and_loads_are_refused() -> None:
    with pytest.raises(ValueError, match="one length"):
        estimate(PRINTED, jnp.zeros(3), jnp.zeros(4), PERIOD)
    with pytest.raises(ValueError, match="DeadWeight"):
        printed_filter(dead_weight())
    with pytest.raises(ValueError, match="Coupon"):
        model_filter(coupon())
