"""Whether one model predicts a run better than another is told from chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smajax.attribution.config import AttributionConfig
from smajax.attribution.paired_errors import compared

CONFIG = AttributionConfig()
N = 700


def _slow(random: np.random.Generator, memory: float = 0.97) -> np.ndarray:
    """Of mean square one, with the memory of a residual that lacks something."""
    drawn = random.normal(size=N + 500)
    return np.asarray(np.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], drawn)[500:])


def test_a_change_that_has_nothing_to_do_with_the_error_is_rarely_called_worse() -> None:
    """What is left is 0.5, the change 0.05 in no relation to it: by the errors alone every second one would be worse."""
    said = []
    for seed in range(200):
        random = np.random.default_rng(seed)
        left = 0.5 * _slow(random)
        said.append(compared([left + 0.05 * _slow(random)], [left], CONFIG))
    larger = sum(one == "worse" for one in said)
    assert larger <= 14, larger  # 2.5 % of chance, and an effective sample number of a few tens
    assert said.count("alike") > 160


@pytest.mark.parametrize(("factor", "expected"), [(0.0, "better"), (2.0, "worse")])
def test_what_takes_away_or_doubles_the_error_is_told(factor: float, expected: str) -> None:
    random = np.random.default_rng(3)
    left, noise = _slow(random), 0.1 * random.normal(size=N)
    assert compared([factor * left + noise], [left + noise], CONFIG) == expected


def test_runs_that_drift_apart_are_told_although_no_correlation_time_is() -> None:
    drift = np.linspace(-0.5, 0.5, N) * 20.0
    noise = np.random.default_rng(4).normal(size=N)
    assert compared([noise + drift], [noise], CONFIG) == "worse"
    assert compared([noise], [noise + drift], CONFIG) == "better"


def test_the_same_prediction_and_no_run_at_all_are_alike() -> None:
    left = np.random.default_rng(5).normal(size=N)
    assert compared([left], [left], CONFIG) == "alike"
    assert compared([], [], CONFIG) == "alike"
    assert compared([1.01 * left], [left], CONFIG) == "alike"  # 1 % has no meaning, however certain
