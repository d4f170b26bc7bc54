"""Signals on a uniform clock, and their noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from smajax.data.readers.noise import detect_quantum, estimate_noise
from smajax.data.readers.resample import resample_input, resample_output, uniform_clock, window_noise_gain

STEP = 0.05


def uneven_time(seed: int = 0) -> np.ndarray:
    """Ten seconds at about 100 Hz, each interval up to a third off."""
    return np.cumsum(np.random.default_rng(seed).uniform(0.0067, 0.0133, size=1000))


def test_the_clock_ends_inside_the_record_and_keeps_an_end_that_rounding_moved() -> None:
    clock = uniform_clock(0.0, 0.3, 0.1)
    np.testing.assert_allclose(clock, [0.0, 0.1, 0.2, 0.3])
    assert uniform_clock(0.0, 0.29, 0.1).size == 3


@pytest.mark.parametrize("step", [0.003, 0.01, 0.05, 0.5])
def test_a_constant_stays_constant(step: float) -> None:
    time = uneven_time()
    values = np.full(time.size, 80.3)
    clock = uniform_clock(time[0], time[-1], step)
    np.testing.assert_array_equal(resample_input(time, values, clock, step), 80.3)
    np.testing.assert_allclose(resample_output(time, values, clock, step).values, 80.3, rtol=1e-15)


@pytest.mark.parametrize("step", [0.003, 0.01, 0.05, 0.5])
def test_a_ramp_of_the_output_has_no_delay(step: float) -> None:
    time = uneven_time()
    clock = uniform_clock(time[0], time[-1], step)
    output = resample_output(time, 3.0 * time - 7.0, clock, step).values
    np.testing.assert_allclose(output, 3.0 * clock - 7.0, atol=1e-11)


def test_an_input_is_its_mean_over_the_step_that_follows() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0])
    values = np.array([0.0, 4.0, 0.0, 2.0])
    np.testing.assert_allclose(resample_input(time, values, np.array([0.5, 2.0, 2.5]), 1.0), [2.0, 0.0, 1.0])
    # Slower than the clock: held, not interpolated.
    np.testing.assert_allclose(resample_input(time, values, np.array([1.0, 1.25, 1.5, 1.75]), 0.25), 4.0)


@pytest.mark.parametrize("at", [0, 411, 998])
def test_a_pulse_of_one_sample_keeps_its_integral(at: int) -> None:
    time = uneven_time()
    values = np.zeros(time.size)
    values[at] = 5.0
    clock = uniform_clock(time[0], time[-1], STEP)
    integral = STEP * np.sum(resample_input(time, values, clock, STEP))
    assert integral == pytest.approx(5.0 * (time[at + 1] - time[at]), rel=1e-9)


def test_a_tone_above_the_clocks_nyquist_frequency_is_attenuated_and_a_slow_one_kept() -> None:
    time = 0.001 * np.arange(10001, dtype=np.float64)
    clock = uniform_clock(0.0, 10.0, STEP)
    fast = resample_output(time, np.sin(2 * np.pi * 19.0 * time), clock, STEP).values
    slow = resample_output(time, np.sin(2 * np.pi * 0.5 * time), clock, STEP).values
    # Sampling alone would show it in full as 1 Hz. Means over w and 2 w pass 4/3 sinc(f w) - 1/3 sinc(2 f w), sinc(x) = sin(pi x)/(pi x).
    width = 7 / 6 * STEP
    let_through = 4 / 3 * np.sinc(19.0 * width) - np.sinc(2 * 19.0 * width) / 3
    assert np.max(np.abs(fast[2:-2])) == pytest.approx(abs(let_through), abs=2e-3)
    assert abs(let_through) < 0.16
    # A mean over one step alone takes 1.0e-3 of it away.
    np.testing.assert_allclose(slow, np.sin(2 * np.pi * 0.5 * clock), atol=5e-6)


@pytest.mark.parametrize("samples", [2, 3, 5, 20, 1.5, 2.5, 7.3])
def test_a_parabola_of_the_output_stays(samples: float) -> None:
    """A mean over a step alone takes a 24th of its curvature times the step squared away."""
    time = STEP / samples * np.arange(2000, dtype=np.float64)
    clock = uniform_clock(0.0, time[-1], STEP)
    result = resample_output(time, 40.0 * (time - 3.0) ** 2, clock, STEP)
    expected = 40.0 * (clock - 3.0) ** 2
    np.testing.assert_allclose(result.values[2:-2], expected[2:-2], rtol=0.0, atol=1e-11 * np.abs(expected).max())


def test_a_parabola_stays_where_the_samples_come_unevenly() -> None:
    time = uneven_time()
    clock = uniform_clock(time[0] + 0.2, time[-1] - 0.2, STEP)
    result = resample_output(time, 3.0 * (time - 4.0) ** 2, clock, STEP)
    np.testing.assert_allclose(result.values, 3.0 * (clock - 4.0) ** 2, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("samples", [2, 3, 5, 10, 50])
def test_white_noise_of_a_sensor_is_white_on_the_clock(samples: int) -> None:
    """Else every model would leave an autocorrelated residual, and the noise that differences of neighbours show would be wrong."""
    noise = np.random.default_rng(samples).normal(size=samples * 20_000)
    time = STEP / samples * np.arange(noise.size, dtype=np.float64)
    values = resample_output(time, noise, uniform_clock(0.0, time[-1], STEP), STEP).values[2:-2]
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0.0, abs=0.035)
    assert np.corrcoef(values[2:], values[:-2])[0, 1] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("samples", [2, 5, 20, 50])
def test_the_noise_gain_is_the_one_that_white_noise_shows(samples: int) -> None:
    interval = STEP / samples
    time = interval * np.arange(samples * 4000, dtype=np.float64)
    noise = np.random.default_rng(1).normal(size=time.size)
    clock = uniform_clock(0.0, time[-1], STEP)
    result = resample_output(time, noise, clock, STEP)
    assert np.std(result.values) == pytest.approx(result.noise_gain, rel=0.04)
    assert result.noise_gain == pytest.approx(1.09 / np.sqrt(samples), rel=0.15)
    assert window_noise_gain(1e4) == pytest.approx(0.01 * np.sqrt(25.0 / 18.0 / (7.0 / 6.0)), rel=1e-3)


def test_nothing_is_averaged_when_the_sensor_is_not_faster_than_the_clock() -> None:
    time = STEP * np.arange(100, dtype=np.float64)
    noise = np.random.default_rng(2).normal(size=100)
    result = resample_output(time, noise, uniform_clock(0.0, time[-1], STEP), STEP)
    np.testing.assert_allclose(result.values, noise, atol=1e-12)
    assert result.noise_gain == 1.0


def step_response(count: int) -> np.ndarray:
    """Slow motion with two jumps: what a noise estimate must not take for noise."""
    t = np.arange(count) / 100.0
    return 10.0 * np.sin(0.3 * t) + 5.0 * (t > 10.0) - 8.0 * (t > 20.0)


@pytest.mark.parametrize("sigma", [0.003, 0.1, 1.0])
def test_noise_is_found_under_motion(sigma: float) -> None:
    signal = step_response(4000) + np.random.default_rng(3).normal(scale=sigma, size=4000)
    assert estimate_noise(signal) == pytest.approx(sigma, rel=0.1)


@pytest.mark.parametrize("sigma", [0.5, 1.0, 2.0])
def test_noise_is_found_through_quantisation(sigma: float) -> None:
    signal = np.round(step_response(4000) + np.random.default_rng(4).normal(scale=sigma, size=4000))
    assert estimate_noise(signal) == pytest.approx(np.hypot(sigma, 1.0 / np.sqrt(12.0)), rel=0.05)


def at_rest(count: int) -> np.ndarray:
    """Six rests, at other places between two levels each."""
    return np.repeat([0.0, 0.13, 3.3, 0.5, 2.71, 1.9], count // 6 + 1)[:count]


@pytest.mark.parametrize("sigma", [0.3, 0.8, 3.0])
@pytest.mark.parametrize("shape", [step_response, at_rest])
def test_noise_of_a_sensor_in_levels_is_right_to_a_few_per_cent(
    sigma: float, shape: Callable[[int], np.ndarray]
) -> None:
    """Truth is the error of the rounded readings themselves; a median of their differences is off by a third."""
    ratios = []
    for seed in range(8):
        clean = shape(800)
        readings = np.round(clean + np.random.default_rng(seed).normal(scale=sigma, size=clean.size))
        ratios.append(estimate_noise(readings) / np.sqrt(np.mean((readings - clean) ** 2)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.04)
    assert np.max(np.abs(np.asarray(ratios) - 1.0)) < 0.12


def test_without_levels_the_noise_is_that_of_the_median_of_differences() -> None:
    signal = step_response(4000) + np.random.default_rng(3).normal(scale=0.1, size=4000)
    medians = [1.4826 * np.median(np.abs(np.diff(signal, n=n))) / np.sqrt(v) for n, v in ((2, 6.0), (3, 20.0))]
    assert estimate_noise(signal) == min(medians)
    # Levels that are fine beside the noise change nothing either.
    fine = np.round(signal[:400] / 0.005) * 0.005
    assert estimate_noise(fine) == pytest.approx(
        min(1.4826 * np.median(np.abs(np.diff(fine, n=n))) / np.sqrt(v) for n, v in ((2, 6.0), (3, 20.0))), rel=1e-12
    )


def test_rounding_is_the_least_noise() -> None:
    signal = 0.0206 * np.round(step_response(4000) / 0.0206)
    quiet = np.where(np.arange(4000) % 50 == 0, 0.0206, 0.0)
    assert detect_quantum(signal) == pytest.approx(0.0206, rel=1e-6)
    assert estimate_noise(quiet) == pytest.approx(0.0206 / np.sqrt(12.0))
    assert estimate_noise(np.zeros(100), quantum=2.0) == pytest.approx(2.0 / np.sqrt(12.0))


def test_no_quantum_is_seen_where_there_is_none() -> None:
    random = np.random.default_rng(5)
    assert detect_quantum(random.normal(size=1000)) == 0.0
    assert detect_quantum(np.sin(np.arange(1000) * 2 * np.pi / 100)) == 0.0
    assert detect_quantum(np.full(100, 3.0)) == 0.0


def test_too_few_samples_for_an_estimate() -> None:
    with pytest.raises(ValueError, match="got 7 samples, expected at least 8"):
        estimate_noise(np.zeros(7))


def test_a_switched_voltage_keeps_its_heat() -> None:
    """25 V for a fifth of the time heats like 25 sqrt(1/5) V, not like 5 V."""
    time = np.arange(0.0, 1.0, 1e-3)
    values = np.where((np.arange(time.size) % 10) < 2, 25.0, 0.0)
    clock = uniform_clock(0.0, 0.9, 0.05)
    np.testing.assert_allclose(resample_input(time, values, clock, 0.05, squared=True), 25.0 * np.sqrt(0.2), rtol=1e-9)
    np.testing.assert_allclose(
        resample_input(time, -values, clock, 0.05, squared=True), -25.0 * np.sqrt(0.2), rtol=1e-9
    )
    np.testing.assert_allclose(resample_input(time, values, clock, 0.05), 5.0, rtol=1e-9)
