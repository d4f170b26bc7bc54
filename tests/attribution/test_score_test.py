"""Score test and the verdict's whiteness: right about noise, blind to what the fitted parameters absorb."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smajax.attribution.residual_diagnostics import all_noise
from smajax.attribution.score_test import ranked
from smajax.core.whiteness import correlation_time, whiteness_p_value
from smajax.fit.sensitivity import Sensitivity

NAMES = ("convection_coefficient", "latent_heat.enthalpy", "ambient_drift.rate", "sensor_lag.time_constant")
BOUNDS = {NAMES[0]: (1.0, 500.0), NAMES[1]: (0.0, 6e4), NAMES[2]: (-0.1, 0.1), NAMES[3]: (0.0, 3.0)}
EFFECTS = ("latent_heat", "ambient_drift", "sensor_lag")


def _at(columns: np.ndarray, misfit: np.ndarray) -> Sensitivity:
    return Sensitivity(NAMES, misfit[None], columns[None], np.ones((1, len(misfit))))


def _columns(rng: np.random.Generator, n: int = 800) -> np.ndarray:
    return rng.normal(size=(n, 4)) * [1.0, 1e-4, 50.0, 1.0]


def test_the_effect_that_is_there_comes_first_with_its_size() -> None:
    rng = np.random.default_rng(1)
    columns = _columns(rng)
    misfit = -columns[:, 2] * 0.05 + 3.0 * columns[:, 0] + rng.normal(size=800)
    scores = ranked(_at(columns, misfit), NAMES[:1], EFFECTS, BOUNDS)
    assert scores[0].effects == ("ambient_drift",)
    assert scores[0].coefficients["ambient_drift.rate"] == pytest.approx(0.05, rel=0.1)
    assert scores[0].p_value < 1e-6
    assert min(score.p_value for score in scores[1:]) > 1e-3


def test_what_fitted_parameters_absorb_does_not_count_as_evidence() -> None:
    rng = np.random.default_rng(2)
    columns = _columns(rng)
    columns[:, 1] = 1e-4 * columns[:, 0]
    scores = ranked(_at(columns, -3.0 * columns[:, 0]), NAMES[:1], EFFECTS, BOUNDS)
    found = {score.effects[0]: score for score in scores}
    assert found["latent_heat"].gain < 1e-6


def test_p_values_are_uniform_when_nothing_is_missing() -> None:
    rng = np.random.default_rng(3)
    small = [
        ranked(_at(_columns(rng), rng.normal(size=800)), NAMES[:1], ("ambient_drift",), BOUNDS)[0].p_value < 0.1
        for _ in range(300)
    ]
    assert np.mean(small) == pytest.approx(0.1, abs=0.06)


def test_a_score_does_not_take_a_coefficient_out_of_its_bounds() -> None:
    rng = np.random.default_rng(4)
    columns = _columns(rng)
    (score,) = ranked(_at(columns, columns[:, 1] * 1e4), NAMES[:1], ("latent_heat",), BOUNDS)
    assert score.coefficients["latent_heat.enthalpy"] == pytest.approx(0.0, abs=1.0)
    assert score.gain < 1e-3


def test_white_and_autocorrelated_noise_are_distinguished() -> None:
    rng = np.random.default_rng(5)
    white = [rng.normal(size=500) for _ in range(3)]
    smooth = [np.convolve(run, np.ones(10) / 10, mode="valid") for run in white]
    assert whiteness_p_value(white) > 1e-3
    assert whiteness_p_value(smooth) < 1e-12
    assert correlation_time(white) == pytest.approx(1.0, abs=0.4)
    assert correlation_time(smooth) == pytest.approx(10.0, rel=0.4)


@pytest.mark.parametrize(("size", "noise"), [(1.0, True), (2.0, True), (20.0, False)])
def test_a_white_residual_is_noise_unless_it_is_far_above_the_noise(size: float, noise: bool) -> None:
    """Shuffled samples leave no memory, and no model can be content with them."""
    left = [size * np.random.default_rng(seed).normal(size=400) for seed in range(3)]
    assert all_noise(left, 1.0) == noise


def test_autocorrelated_noise_may_miss_its_level_by_what_its_correlation_accounts_for() -> None:
    rng = np.random.default_rng(1)
    drawn = rng.normal(size=(40, 4, 900))
    slow = lfilter([0.6], [1.0, -0.8], drawn, axis=2)[..., 500:]  # of size one, and eight samples of memory
    answers = [all_noise(list(runs), 1.0) for runs in slow]
    assert sum(answers) >= 30
    assert not any(all_noise(list(1.3 * runs), 1.0) for runs in slow)
    # Of what a slow trace adds to white noise no more than a tenth of the mean square passes.
    white, trace = drawn[0, :, :400], np.sin(np.linspace(0.0, 6.0, 400))
    assert not all_noise(list(white + 0.6 * trace), 1.0)


def test_filtered_noise_is_noise_where_the_noise_was_estimated_and_a_trend_is_none() -> None:
    """The runs of `test_filtered_noise_is_distinguished_from_a_trend`."""
    random = np.random.default_rng(7)
    made = [lfilter([0.3], [1.0, -0.8], random.normal(size=1200))[200:] for _ in range(3)]
    slow = [random.normal(size=1000) + np.sin(np.linspace(0.0, 9.0, 1000)) for _ in range(3)]
    assert all_noise(made, 0.3, noise_given=False)
    assert not all_noise(made, 0.3)
    assert not all_noise(slow, 1.0, noise_given=False)
