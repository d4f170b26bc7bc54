"""The filter that estimates parameters too: they come to the plant's, it has derivatives, and it is the filter below where nothing is to be estimated."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.estimators.adaptive_filter import LARGEST, AdaptiveFilter
from smajax.control.estimators.believed_state import with_vector
from smajax.control.estimators.kalman import Innovation
from smajax.control.estimators.model_filter import OFF_BRANCH, none_yet, unexplained
from smajax.control.estimators.run import estimate
from smajax.control.presets import FILTERS, adaptive_filter
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.presets import build
from smajax.model.rigs import arm
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.machine_code import by_machine_code

PERIOD, COUNT, NOISE = 0.01, 400, 1.7e-3  # s, -, rad
ARM = arm()
# Up to the middle of the way, held and back: 10 V would be through in 0.4 s.
VOLTS = jnp.where(jnp.arange(COUNT) * PERIOD < 1.6, 8.0, jnp.where(jnp.arange(COUNT) * PERIOD < 2.6, 6.2, 3.0))
FILTER = adaptive_filter(ARM)
WRONG = {"convection_coefficient": 0.8, "damping": 1.2, "inertia_ratio": 0.8}

followed = by_machine_code(lambda estimator, readings, volts: estimate(estimator, readings, volts, PERIOD))


def _plant(ratios: dict[str, float]):
    names = list(ratios)
    return set_parameters(
        ARM, dict(zip(names, get_parameters(ARM, names) * np.asarray(list(ratios.values())), strict=True))
    )


def _readings(ratios: dict[str, float]):
    truth = simulate_compiled(_plant(ratios), {"voltage": VOLTS}, PERIOD)
    return truth, truth.position + NOISE * jax.random.normal(jax.random.key(2), (COUNT,))


@pytest.fixture(scope="module")
def wrong_convection():
    truth, readings = _readings({"convection_coefficient": 0.8})
    return truth, readings, *followed(FILTER, readings, VOLTS)


def test_the_convection_comes_to_the_plants(wrong_convection) -> None:
    _, _, memory, _ = wrong_convection
    ratio = np.exp(np.asarray(memory.logarithms)[:, FILTER.estimated.index("convection_coefficient")])
    assert ratio[0] == 1.0
    assert np.abs(ratio[-50:] - 0.8).max() < 0.04
    spread = np.sqrt(np.asarray(memory.covariance)[-1, 4, 4])
    assert np.abs(np.log(ratio[-1] / 0.8)) < 4.0 * spread
    assert spread < 0.25 * 0.12


def test_the_temperature_is_nearer_than_that_of_the_filter_that_believes_the_nominal_convection(
    wrong_convection,
) -> None:
    truth, readings, _, told = wrong_convection
    _, nominal = followed(FILTERS["model"](ARM), readings, VOLTS)
    here = slice(200, None)  # the arm has moved
    rms = lambda one, other: float(jnp.sqrt(jnp.mean((one - other)[here] ** 2)))  # noqa: E731
    assert rms(told.temperature, truth.temperature) < 0.4 * rms(nominal.temperature, truth.temperature)
    assert abs(float(jnp.mean((told.position - truth.position)[here]))) < np.radians(0.1)


def test_with_three_parameters_wrong_nothing_is_nan_and_the_covariance_stays_positive() -> None:
    truth, readings = _readings(WRONG)
    memory, told = followed(FILTER, readings, VOLTS)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((memory, told)))
    assert np.linalg.eigvalsh(np.asarray(memory.covariance)).min() > 0.0
    # At rest damping and inertia move nothing: their variance does not grow beyond sigma's.
    assert np.sqrt(np.asarray(memory.covariance)[:, 5:, 5:].diagonal(axis1=1, axis2=2)).max() < 1.01 * 0.12
    assert np.abs(told.temperature - truth.temperature)[-50:].max() < 1.0


def test_without_an_error_to_estimate_it_is_the_filter_below() -> None:
    _, readings = _readings({"convection_coefficient": 0.9})
    certain = set_parameters(FILTER, {"ratio_error": 0.0})
    memory, told = followed(certain, readings, VOLTS)
    _, below = followed(FILTER.filter, readings, VOLTS)
    assert np.abs(memory.logarithms).max() == 0.0
    for one, other in zip(jax.tree.leaves(told), jax.tree.leaves(below), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_a_parameter_stays_within_a_factor_of_e_whatever_is_read() -> None:
    wild = jnp.where(jnp.arange(COUNT) % 2 == 0, 1.5, -0.7)
    sure = set_parameters(FILTER, {"reading_noise": 1e-6, "ratio_error": 1.0})
    memory, _ = followed(sure, wild, VOLTS)
    logarithms = np.asarray(memory.logarithms)
    assert np.isfinite(logarithms).all()
    assert np.abs(logarithms).max() <= LARGEST


@pytest.mark.slow
def test_a_step_has_a_derivative_in_reading_voltage_and_settings(wrong_convection) -> None:
    _, readings, memory, _ = wrong_convection
    moving = jax.tree.map(lambda leaf: leaf[110], memory)

    def temperature(reading, voltage, sigma):
        estimator = set_parameters(FILTER, {"ratio_error": sigma})
        return estimator.step(moving, reading, voltage, jnp.asarray(PERIOD))[1].temperature

    at = (readings[111], VOLTS[110], jnp.asarray(0.12))
    slopes = [float(one) for one in jax.jit(jax.jacfwd(temperature, (0, 1, 2)))(*at)]
    assert np.isfinite(slopes).all()
    width, value = 1e-3, jax.jit(temperature)
    by_difference = (value(at[0], at[1] + width, at[2]) - value(at[0], at[1] - width, at[2])) / (2 * width)
    assert slopes[1] == pytest.approx(float(by_difference), rel=1e-3)
    assert slopes[0] != 0.0


@pytest.mark.slow
def test_in_single_precision_the_convection_comes_out_the_same(wrong_convection) -> None:
    _, readings, memory, _ = wrong_convection
    single = lambda tree: jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), tree)  # noqa: E731
    with jax.enable_x64(False):
        narrow, told = jax.jit(lambda one, y, u: estimate(one, y, u, PERIOD))(
            single(FILTER), single(readings), single(VOLTS)
        )
    assert told.temperature.dtype == jnp.float32
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((narrow, told)))
    np.testing.assert_allclose(narrow.logarithms[-1, 0], memory.logarithms[-1, 0], atol=0.01)


def test_its_parameters_are_those_that_the_load_has() -> None:
    spring = FILTERS["adaptive"](build("flexinol_table_3_2", "bias_spring", "flexinol_voltage"))
    assert isinstance(spring, AdaptiveFilter)
    assert spring.estimated[0] == "convection_coefficient"
    assert set(FILTER.estimated) == set(WRONG)
    assert dataclasses.replace(FILTER, estimated=("convection_coefficient",)).believed(jnp.zeros(1)).load == ARM.load


def test_the_heating_curve_begins_at_all_martensite_at_most(wrong_convection) -> None:
    """Below, where the amplitude stands for a temperature that is off, it does not."""
    _, readings, memory, _ = wrong_convection
    assert float(memory.state.wire.xi_M.max()) <= 1.0
    free = dataclasses.replace(FILTER, filter=dataclasses.replace(FILTER.filter, keeps_branches=False))
    assert float(followed(free, readings, VOLTS)[0].state.wire.xi_M.max()) > 1.0


@pytest.mark.parametrize(
    ("last", "now", "lost"),
    [
        (0.0, 9.0, False),  # a glitch
        (9.0, -9.0, False),  # and the reading after it
        (9.0, 4.0, False),
        (4.0, 9.0, False),
        (6.0, 6.0, True),
        (-6.0, -6.0, True),
    ],
)
def test_two_innovations_beyond_five_standard_deviations_on_the_same_side_are_a_branch_lost(
    last: float, now: float, lost: bool
) -> None:
    of = lambda sigmas: Innovation(jnp.asarray(sigmas * 2e-3), jnp.asarray(4e-6))  # noqa: E731
    assert bool(unexplained(of(last), of(now))) is lost
    assert not bool(unexplained(none_yet(jnp.asarray(1.0)), of(now)))


@pytest.mark.parametrize(("lost", "amplitude"), [(False, 1.0), (True, 0.3)])
def test_a_branch_that_is_lost_lays_the_curves_through_the_state(lost: bool, amplitude: float) -> None:
    """A wire of 0.28 martensite rests below the curve of a full transformation, and the correction makes it 0.30: it has turned back unseen."""
    at_rest = FILTER.start(jnp.asarray(0.0))[0].state
    # Strain and stress count from the rest, so the position goes with the fraction.
    vector = jnp.asarray([0.5, 0.0, 65.0, 0.28])
    resting = with_vector(ARM, at_rest, vector)
    no = jnp.zeros((), bool)
    found = eqx.filter_jit(FILTER.filter.consistent)(ARM, resting, vector.at[3].set(0.30), no, jnp.asarray(lost))
    assert float(found.wire.xi_M) == pytest.approx(amplitude, abs=1e-6)


def test_a_branch_that_is_lost_makes_temperature_and_fraction_less_certain_and_nothing_else(wrong_convection) -> None:
    covariance = wrong_convection[2].covariance[-1]
    added = np.asarray(FILTER.filter.widened(covariance, jnp.asarray(True)) - covariance)
    np.testing.assert_allclose(np.sqrt(added.diagonal()), [0.0, 0.0, *OFF_BRANCH, 0.0, 0.0, 0.0], rtol=1e-9)
    assert np.count_nonzero(added) == 2
    assert (FILTER.filter.widened(covariance, jnp.asarray(False)) == covariance).all()


def _swing(period: float):
    """(truth, readings, voltages) of a wire that is heated and then swings inside its hysteresis, `period` seconds long, with 0.8 of the convection."""
    time = np.arange(COUNT) * PERIOD
    volts = jnp.asarray(np.where(time < 1.4, 8.0, 6.0 + 1.5 * np.sin(2.0 * np.pi * time / period)))
    truth = simulate_compiled(_plant({"convection_coefficient": 0.8}), {"voltage": volts}, PERIOD)
    return truth, truth.position + NOISE * jax.random.normal(jax.random.key(2), (COUNT,)), volts


def _rms(truth, readings, volts, after: slice) -> float:
    """Of the error of the estimated position, degrees."""
    _, told = followed(FILTER, readings, volts)
    return float(np.degrees(np.sqrt(np.mean(np.asarray(told.position - truth.position)[after] ** 2))))


def test_a_wire_that_turns_inside_its_hysteresis_is_followed() -> None:
    """0.20 degrees where the fraction is believed as surely after the branch was lost as before."""
    truth, readings, volts = _swing(2.5)
    assert _rms(truth, readings, volts, slice(200, COUNT)) < 0.1


def test_one_wrong_reading_of_a_wire_between_its_branches_lays_no_curve() -> None:
    """By 1.1 degrees, while nothing transforms: 0.1 degrees in the second after it where one innovation lays the curves."""
    truth, readings, volts = _swing(1.5)
    assert _rms(truth, readings, volts, slice(272, 372)) < 0.03
    for wrong in (258, 271, 285, 299):
        assert np.ptp(np.asarray(truth.martensite_fraction)[wrong - 5 : wrong + 5]) < 1e-3
        for by in (0.02, -0.02):
            assert _rms(truth, readings.at[wrong].add(by), volts, slice(wrong + 1, wrong + 101)) < 0.05
