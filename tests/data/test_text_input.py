"""The increment of a coarse sensor is read off its log."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.data.readers.resolution_levels import likeliest_increment


def _strokes(rng: np.random.Generator, samples: int = 800) -> list[np.ndarray]:
    """Three runs that rest at both ends and pass slowly between, each with a zero of its own."""
    time = np.linspace(0.0, 1.0, samples)
    return [
        1e-2 * np.clip(1.6 * np.sin(np.pi * count * time) ** 2 - 0.3, 0.0, 1.0) + zero
        for count, zero in zip((1, 2, 3), rng.uniform(-1e-3, 1e-3, 3), strict=True)
    ]


@pytest.mark.parametrize("share", [0.03, 0.071, 0.12])
def test_the_increment_of_a_staircase_is_found(share: float) -> None:
    rng, increment = np.random.default_rng(3), share * 1e-2
    logs = []
    for zero, stroke in enumerate(_strokes(rng)):
        stairs = increment * np.round(stroke / increment) + 1e-4 * zero
        logs.append(stairs + 0.05 * increment * rng.normal(size=stroke.size))
    assert likeliest_increment(logs, 0.05 * increment) == pytest.approx(increment, rel=0.5 * share)


@pytest.mark.parametrize("samples", [200, 800, 8000])
@pytest.mark.parametrize("noises", [6.0, 7.5, 9.5, 11.0, 25.0])
def test_levels_are_found_however_many_samples_show_their_noise(noises: float, samples: int) -> None:
    rng, increment = np.random.default_rng(5), 0.05 * 1e-2
    logs = [
        increment * np.round(stroke / increment) + increment / noises * rng.normal(size=samples)
        for stroke in _strokes(rng, samples)
    ]
    assert likeliest_increment(logs, increment / noises) == pytest.approx(increment, rel=0.02)


@pytest.mark.parametrize("noises", [6.2, 12.0])
def test_levels_that_one_run_does_not_have_are_none_of_the_sensor(noises: float) -> None:
    rng = np.random.default_rng(8)
    increment, strokes = 0.05 * 1e-2, [*_strokes(rng, 800), *_strokes(rng, 800)[:1]]
    logs = [
        (increment * np.round(stroke / increment) if run < 3 else stroke)
        + increment / noises * rng.normal(size=stroke.size)
        for run, stroke in enumerate(strokes)
    ]
    assert likeliest_increment(logs, increment / noises) == 0.0
    assert likeliest_increment(logs[:3], increment / noises) == pytest.approx(increment, rel=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_a_few_places_where_a_reading_rests_are_no_levels(seed: int) -> None:
    """Four a run: at some of a thousand increments they lie as if on levels."""
    rng = np.random.default_rng(seed)
    logs = [np.repeat(rng.uniform(0.0, 1e-2, 4), 200) + 1e-5 * rng.normal(size=800) for _ in range(3)]
    assert likeliest_increment(logs, 1e-5) == 0.0


@pytest.mark.parametrize("samples", [3, 10])
@pytest.mark.parametrize("levels", [5, 10])
def test_set_points_at_even_distances_are_no_levels_of_the_sensor(levels: int, samples: int) -> None:
    """Two runs of one staircase of set points, each reached with a time constant of a few samples."""
    rng, sigma = np.random.default_rng(6), 1e-5
    wanted = np.repeat(30.0 * sigma * np.array([*range(levels), *range(levels, 0, -1)]), 150)
    logs = []
    for _ in range(2):
        reached = np.zeros(len(wanted))
        for k in range(1, len(wanted)):
            reached[k] = reached[k - 1] + (wanted[k] - reached[k - 1]) / samples
        logs.append(reached + sigma * rng.normal(size=len(wanted)))
    assert likeliest_increment(logs, sigma) == 0.0


def test_a_long_log_without_noise_that_goes_everywhere_has_no_increment() -> None:
    rng = np.random.default_rng(7)
    log = np.cumsum(rng.normal(size=100_000))
    assert likeliest_increment([log, log[::-1]], 0.0) == 0.0


def test_a_smooth_log_has_no_increment() -> None:
    rng = np.random.default_rng(4)
    logs = [stroke + 1e-5 * rng.normal(size=stroke.size) for stroke in _strokes(rng)]
    assert likeliest_increment(logs, 1e-5) == 0.0
    still = [1e-6 * rng.normal(size=100)]
    assert likeliest_increment(still, 1e-6) == 0.0
