"""A filter over a log as logs are: gaps, another unit, a noise in words."""

from __future__ import annotations

import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.estimators.run import ReadingsWarning, estimate
from smajax.control.presets import filter_of
from smajax.core.parameters import set_parameters
from smajax.model.presets import build
from smajax.simulation.compiled import simulate_compiled

ARM = build("niti_table_3_1", "arm", "amplified_voltage")
PERIOD, NOISE = 0.01, float(np.radians(0.3))
VOLTAGE = np.where(np.arange(401) < 250, 8.0, 0.0)
TRUE = simulate_compiled(ARM, {"voltage": jnp.asarray(VOLTAGE)}, PERIOD)
READING = np.asarray(TRUE.position) + NOISE * np.random.default_rng(0).standard_normal(VOLTAGE.size)


@pytest.mark.parametrize("name", ["model", "adaptive"])
def test_a_gap_in_the_readings_corrects_nothing_and_spoils_nothing(name: str) -> None:
    gap = slice(200, 215)
    missing = READING.copy()
    missing[gap] = np.nan
    ekf = filter_of(name, ARM, NOISE)
    memory, state = estimate(ekf, missing, VOLTAGE, PERIOD)
    _, whole = estimate(ekf, READING, VOLTAGE, PERIOD)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((memory, state)))
    np.testing.assert_array_equal(state.position[:200], whole.position[:200])
    assert np.abs(np.asarray(state.temperature - TRUE.temperature))[gap].max() < 1.0
    np.testing.assert_allclose(state.position[300:], whole.position[300:], atol=NOISE)
    filtered = memory.filter if name == "adaptive" and hasattr(memory, "filter") else memory
    spread = np.asarray(filtered.covariance)[:, 0, 0]
    assert (np.diff(spread[199:214]) > 0.0).all()  # ever less is known in the gap


def test_every_second_reading_is_enough_to_see_that_a_branch_was_lost() -> None:
    """Air 20 K warmer than believed: two innovations in a row that nothing explains widen the belief; a missing reading between them is no innovation."""
    warm = set_parameters(ARM, {"ambient_temperature": 40.0})
    true = simulate_compiled(warm, {"voltage": jnp.asarray(VOLTAGE)}, PERIOD)
    reading = np.asarray(true.position) + NOISE * np.random.default_rng(1).standard_normal(VOLTAGE.size)
    thinned = np.where(np.arange(reading.size) % 2 == 1, np.nan, reading)
    off = [
        np.std(
            np.asarray(estimate(filter_of("adaptive", ARM, NOISE), one, VOLTAGE, PERIOD)[1].position - true.position)
        )
        for one in (reading, thinned)
    ]
    assert off[1] < 2.0 * off[0]


def test_a_filter_may_be_traced_with_a_log_at_hand() -> None:
    ekf = filter_of("model", ARM, NOISE)
    found = eqx.filter_jit(lambda one: estimate(one, jnp.asarray(READING), jnp.asarray(VOLTAGE), PERIOD)[1].position)(
        ekf
    )
    np.testing.assert_allclose(found, estimate(ekf, READING, VOLTAGE, PERIOD)[1].position, atol=1e-9)


def test_a_log_that_begins_with_a_gap_and_a_filter_that_needs_every_reading_are_refused() -> None:
    late = READING.copy()
    late[0] = np.nan
    with pytest.raises(ValueError, match="first of `readings` is NaN"):
        estimate(filter_of("model", ARM, NOISE), late, VOLTAGE, PERIOD)
    gap = READING.copy()
    gap[100:103] = np.nan
    with pytest.raises(ValueError, match="3 of `readings` are NaN, and the filter `printed`"):
        estimate(filter_of("printed", ARM), gap, VOLTAGE, PERIOD)


def test_readings_where_the_arm_cannot_be_are_said() -> None:
    ekf = filter_of("model", ARM, NOISE)
    with pytest.warns(
        ReadingsWarning, match=r"go from -4.* rad, and the load from -0.7854 to 1.658 rad: are they in rad"
    ):
        estimate(ekf, np.degrees(READING), VOLTAGE, PERIOD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        estimate(ekf, READING, VOLTAGE, PERIOD)
        jax.jit(lambda one: estimate(ekf, one, jnp.asarray(VOLTAGE), PERIOD)[1].position)(jnp.asarray(READING))


def test_a_noise_may_be_text() -> None:
    assert float(filter_of("model", ARM, "0.3 deg").reading_noise) == pytest.approx(np.radians(0.3))
