"""Sums over lags of a residual: of a long one by Fourier transform, the same numbers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from smajax.core import whiteness as noise_like
from smajax.core.whiteness import (
    WHITE,
    autocorrelation,
    bartlett_sum,
    correlation_time,
    first_order,
    whiteness_p_value,
)

SERIES = np.random.default_rng(3).normal(size=(997, 3)).cumsum(axis=0)


@pytest.mark.parametrize(
    "asked",
    [
        lambda: autocorrelation(SERIES[:, 0], 0),
        lambda: autocorrelation(SERIES[:, 0], 249),
        lambda: autocorrelation(SERIES[:40, 0], 60),
        lambda: bartlett_sum(SERIES, 0),
        lambda: bartlett_sum(SERIES, 249),
        lambda: bartlett_sum(SERIES[:7], 6),
    ],
)
def test_a_long_residual_is_summed_to_the_same_numbers(
    monkeypatch: pytest.MonkeyPatch, asked: Callable[[], np.ndarray]
) -> None:
    found = []
    for many in (np.inf, -1):
        monkeypatch.setattr(noise_like, "MANY", many)
        found.append(asked())
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-12 * np.abs(found[0]).max())


def test_the_weighted_sum_is_what_its_formula_says() -> None:
    some = SERIES[:30]
    said = sum(
        (1.0 - abs(i - j) / 5.0) * np.outer(some[i], some[j]) for i in range(30) for j in range(30) if abs(i - j) <= 4
    )
    np.testing.assert_allclose(bartlett_sum(some, 4), said, rtol=1e-12)


def test_a_constant_and_a_single_sample_count_as_white() -> None:
    constant, single = np.full(50, 0.1), np.array([3.0])
    assert whiteness_p_value([constant]) == 1.0
    assert whiteness_p_value([single]) == 1.0
    assert correlation_time([constant]) == correlation_time([single]) == 1.0


def test_filtered_noise_is_distinguished_from_a_trend() -> None:
    """The AR(1) that made a noise is found, nothing is left beyond; a slow trace beside white noise is no such noise."""
    random = np.random.default_rng(7)
    made = [lfilter([0.3], [1.0, -0.8], random.normal(size=1200))[200:] for _ in range(3)]
    found = first_order(made)
    assert found.coefficient == pytest.approx(0.8, abs=0.03)
    assert found.sigma == pytest.approx(0.3, rel=0.05)
    assert found.p_value > WHITE
    slow = [random.normal(size=1000) + np.sin(np.linspace(0.0, 9.0, 1000)) for _ in range(3)]
    assert first_order(slow).p_value < 1e-6
