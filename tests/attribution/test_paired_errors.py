"""Whether one model predicts runs better than another is told from chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smajax.attribution.config import AttributionConfig
from smajax.attribution.paired_errors import compared

CONFIG = AttributionConfig()
N = 700
Runs = list[np.ndarray]


def _slow(random: np.random.Generator, time: float = 60.0, count: int = N) -> np.ndarray:
    """Of mean square one, with the correlation time (samples) of a residual that lacks something."""
    memory = (time - 1.0) / (time + 1.0)
    drawn = random.normal(size=count + int(10.0 * time))
    return np.asarray(np.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], drawn)[-count:])


def _as_good(seed: int, runs: int, scatter: float, count: int = N, time: float = 60.0) -> tuple[Runs, Runs]:
    """Two models of the same error, a third of it their own. `scatter`: logarithmic, of each one's own error from run to run."""
    random = np.random.default_rng([seed, runs])
    new: Runs = []
    old: Runs = []
    for _ in range(runs):
        common = np.sqrt(0.7) * _slow(random, time, count) + 0.2 * random.normal(size=count)
        for own in (new, old):
            own.append(common + np.exp(scatter * random.normal()) * np.sqrt(0.3) * _slow(random, time, count))
    return new, old


@pytest.mark.parametrize(
    ("runs", "scatter", "count", "time", "most"),
    [(1, 0.0, N, 30.0, 0.08), (1, 0.0, N, 100.0, 0.10), (1, 0.0, 60, 5.0, 0.10), (2, 0.4, N, 60.0, 0.10), (3, 0.4, N, 60.0, 0.08)],
)  # fmt: skip
def test_of_two_models_that_are_as_good_one_is_rarely_called_worse(
    runs: int, scatter: float, count: int, time: float, most: float
) -> None:
    """2.3 % if everything were known of the residuals, and half of all by the errors alone. With several runs, also where each model is better in some."""
    said = [compared(*_as_good(seed, runs, scatter, count, time), CONFIG) for seed in range(200)]
    assert said.count("worse") / 200 < most
    assert said.count("better") / 200 < most


@pytest.mark.parametrize("runs", [1, 2, 3])
def test_outputs_of_a_run_are_no_runs(runs: int) -> None:
    """What a run has of its own is in all of its outputs."""
    outputs = 3
    owners = [run for run in range(runs) for _ in range(outputs)]
    said = []
    for seed in range(200):
        random = np.random.default_rng([seed, 7])
        new, old = (
            [one + 0.2 * random.normal(size=N) for one in models for _ in range(outputs)]
            for models in _as_good(seed, runs, 0.4 if runs > 1 else 0.0)
        )
        said.append(compared(new, old, CONFIG, owners))
    assert said.count("worse") / 200 < 0.1
    assert said.count("better") / 200 < 0.1


@pytest.mark.parametrize("runs", [1, 2, 3])
@pytest.mark.parametrize(("factor", "expected"), [(0.0, "better"), (2.0, "worse")])
def test_what_takes_away_or_doubles_the_error_is_told(factor: float, expected: str, runs: int) -> None:
    random = np.random.default_rng(3)
    left = [_slow(random) for _ in range(runs)]
    noise = [0.1 * random.normal(size=N) for _ in range(runs)]
    new = [factor * one + other for one, other in zip(left, noise, strict=True)]
    old = [one + other for one, other in zip(left, noise, strict=True)]
    assert compared(new, old, CONFIG) == expected


def test_a_model_that_is_a_quarter_worse_is_told_in_most_cases() -> None:
    said = []
    for seed in range(100):
        random = np.random.default_rng(seed)
        left = _slow(random, 30.0) + 0.2 * random.normal(size=N)
        said.append(compared([left + 0.75 * _slow(random, 30.0)], [left], CONFIG))
    assert said.count("worse") > 60
    assert "better" not in said


def test_runs_that_drift_apart_are_told_although_their_squares_have_no_correlation_time() -> None:
    drift = np.linspace(-0.5, 0.5, N) * 20.0
    noise = np.random.default_rng(4).normal(size=N)
    assert compared([noise + drift], [noise], CONFIG) == "worse"
    assert compared([noise], [noise + drift], CONFIG) == "better"


def test_the_same_prediction_and_no_run_at_all_are_alike() -> None:
    left = np.random.default_rng(5).normal(size=N)
    assert compared([left], [left], CONFIG) == "alike"
    assert compared([], [], CONFIG) == "alike"
    assert compared([1.01 * left], [left], CONFIG) == "alike"  # 1 % has no meaning, however certain
    assert compared([np.zeros(N)], [left], CONFIG) == "better"


def test_a_model_without_a_number_is_worse() -> None:
    left = np.random.default_rng(6).normal(size=N)
    for missing in (np.full(N, np.nan), np.where(np.arange(N) > 600, np.nan, left), np.full(N, np.inf)):
        assert compared([missing], [left], CONFIG) == "worse"
        assert compared([left], [missing], CONFIG) == "better"
        assert compared([missing], [missing], CONFIG) == "alike"
