"""Least squares in a box: the same end as scipy's, wherever the optimum lies, and none where there is no number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from smajax.fit.directions import directions, weak_ones
from smajax.fit.levenberg_marquardt import MOST_STEPS, _judged, _step, _Walk
from smajax.fit.robust import robust_variance
from smajax.fit.sensitivity import Sensitivity


def _ended(columns: np.ndarray, asked: np.ndarray, start: np.ndarray) -> _Walk:
    square = columns.T @ columns

    def at(place: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        residual = columns @ place - asked
        return float(residual @ residual), columns.T @ residual, square

    cost, slope, _ = at(start)
    walk = _Walk(start, cost, slope, square, np.diag(square).copy())
    while not walk.reason and walk.steps < MOST_STEPS:
        step = _step(walk)
        _judged(walk, step, *at(np.clip(walk.place + step, 0.0, 1.0)))
    return walk


@pytest.mark.parametrize("size", [2, 3, 6])
def test_linear_problems_end_where_scipys_do(size: int) -> None:
    """Optima inside, on edges and in corners of the box."""
    rng = np.random.default_rng(size)
    for _ in range(100):
        columns = rng.standard_normal((50, size))
        truth = rng.uniform(-0.3, 1.3, size)
        asked = columns @ truth + 0.1 * rng.standard_normal(50)
        walk = _ended(columns, asked, rng.uniform(size=size))
        least = 2.0 * lsq_linear(columns, asked, (0.0, 1.0), method="bvls").cost
        assert walk.reason
        assert walk.cost == pytest.approx(least, rel=1e-4)


def test_a_jacobian_without_a_number_is_a_step_that_is_not_taken() -> None:
    walk = _Walk(np.full(2, 0.5), 1.0, np.ones(2), np.eye(2), np.ones(2))
    before = walk.place.copy()
    _judged(walk, np.full(2, -0.1), 0.5, np.array([np.nan, 1.0]), np.eye(2))
    np.testing.assert_array_equal(walk.place, before)
    assert not walk.reason


def test_equations_that_are_singular_to_rounding_are_no_error() -> None:
    """Two parameters with one trace and next to no damping: a Cholesky factor may exist where a solution does not."""
    random = np.random.default_rng(0)
    for _ in range(500):
        row = random.normal(size=2) * 10.0 ** random.integers(-3, 3, size=2)
        walk = _Walk(np.full(2, 0.5), 1.0, row, np.outer(row, row), row**2, damping=0.0)
        assert np.isfinite(_step(walk)).all()


def test_two_that_act_by_their_product_are_no_parameters_without_effect() -> None:
    column = np.random.default_rng(0).standard_normal(300)
    at = Sensitivity(("a", "b"), np.zeros((1, 300)), np.stack([column, column], axis=1)[None], np.ones((1, 300)))
    told = weak_ones(directions(at, ("a", "b"), {"a": 1.0, "b": 1.0}, 1.0))
    assert len(told) == 2 or "no one of them is known by itself" in told[0]
    assert "no one of them is known by itself" in told[0]
    assert not any("Nothing" in sentence for sentence in told)


def test_the_variance_of_a_robust_mean_is_what_repeated_ones_have() -> None:
    """Huber's mean of samples of which a tenth is far off: its variance over repetitions."""
    rng = np.random.default_rng(3)
    means, told = [], []
    for _ in range(400):
        sample = np.where(rng.uniform(size=300) < 0.1, 10.0, 1.0) * rng.standard_normal(300)
        centre = float(np.median(sample))
        for _ in range(30):
            spread = 1.4826 * np.median(np.abs(sample - centre))
            weight = 1.0 / np.maximum(np.abs(sample - centre) / (1.345 * spread), 1.0)
            centre = float((weight * sample).sum() / weight.sum())
        means.append(centre)
        told.append(robust_variance(sample - centre) / 300)
    assert np.mean(told) == pytest.approx(np.var(means), rel=0.2)
