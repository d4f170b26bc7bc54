"""Least squares within bounds: the same end as scipy's, wherever the optimum lies, and none where there is no number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from smajax.fit.directions import directions, weak_combinations
from smajax.fit.levenberg_marquardt import MAX_STEPS, LMState, _step, _update
from smajax.fit.robust import robust_variance
from smajax.fit.sensitivity import Sensitivity


def _fitted(columns: np.ndarray, target: np.ndarray, start: np.ndarray) -> LMState:
    square = columns.T @ columns

    def at(y: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        residual = columns @ y - target
        return float(residual @ residual), columns.T @ residual, square

    cost, slope, _ = at(start)
    state = LMState(start, cost, slope, square, np.diag(square).copy())
    while not state.reason and state.steps < MAX_STEPS:
        step = _step(state)
        _update(state, step, at(np.clip(state.y + step, 0.0, 1.0)))
    return state


@pytest.mark.parametrize("size", [2, 3, 6])
def test_linear_problems_end_where_scipys_do(size: int) -> None:
    """Optima inside, on edges and in corners of the box."""
    rng = np.random.default_rng(size)
    for _ in range(100):
        columns = rng.standard_normal((50, size))
        truth = rng.uniform(-0.3, 1.3, size)
        target = columns @ truth + 0.1 * rng.standard_normal(50)
        state = _fitted(columns, target, rng.uniform(size=size))
        least = 2.0 * lsq_linear(columns, target, (0.0, 1.0), method="bvls").cost
        assert state.reason
        assert state.cost == pytest.approx(least, rel=1e-4)


def test_a_step_to_a_jacobian_that_is_not_finite_is_rejected() -> None:
    state = LMState(np.full(2, 0.5), 1.0, np.ones(2), np.eye(2), np.ones(2))
    before = state.y.copy()
    _update(state, np.full(2, -0.1), (0.5, np.array([np.nan, 1.0]), np.eye(2)))
    np.testing.assert_array_equal(state.y, before)
    assert not state.reason


def test_equations_that_are_singular_to_rounding_are_no_error() -> None:
    """Two parameters with one trace and next to no damping: a Cholesky factor may exist where a solution does not."""
    random = np.random.default_rng(0)
    for _ in range(500):
        row = random.normal(size=2) * 10.0 ** random.integers(-3, 3, size=2)
        state = LMState(np.full(2, 0.5), 1.0, row, np.outer(row, row), row**2, damping=0.0)
        assert np.isfinite(_step(state)).all()


def test_two_that_act_by_their_product_are_no_parameters_without_effect() -> None:
    column = np.random.default_rng(0).standard_normal(300)
    at = Sensitivity(("a", "b"), np.zeros((1, 300)), np.stack([column, column], axis=1)[None], np.ones((1, 300)))
    sentences = weak_combinations(directions(at, ("a", "b"), {"a": 1.0, "b": 1.0}, 1.0))
    assert len(sentences) == 2 or "none of them is identifiable by itself" in sentences[0]
    assert "none of them is identifiable by itself" in sentences[0]
    assert not any("Nothing" in sentence for sentence in sentences)


def test_the_variance_of_a_robust_mean_is_what_repeated_ones_have() -> None:
    """Huber's mean of samples of which a tenth is far off: its variance over repetitions."""
    rng = np.random.default_rng(3)
    means, predicted = [], []
    for _ in range(400):
        sample = np.where(rng.uniform(size=300) < 0.1, 10.0, 1.0) * rng.standard_normal(300)
        centre = float(np.median(sample))
        for _ in range(30):
            spread = 1.4826 * np.median(np.abs(sample - centre))
            weight = 1.0 / np.maximum(np.abs(sample - centre) / (1.345 * spread), 1.0)
            centre = float((weight * sample).sum() / weight.sum())
        means.append(centre)
        predicted.append(robust_variance(sample - centre) / 300)
    assert np.mean(predicted) == pytest.approx(np.var(means), rel=0.2)
