"""Error bars: right where the runs tell a parameter, withheld where they do not."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.fit.sensitivity import Sensitivity
from smajax.fit.uncertainty import identifiability, uncertainty

BOUNDS = dict.fromkeys("abc", (-10.0, 10.0))
VALUES = dict.fromkeys("abc", 1.0)


def _sensitivity(columns: np.ndarray, residual: np.ndarray) -> Sensitivity:
    names = tuple("abc"[: columns.shape[1]])
    return Sensitivity(names, residual[None], columns[None], np.ones((1, len(residual))))


def test_standard_errors_are_those_of_least_squares_when_the_residual_is_white() -> None:
    rng = np.random.default_rng(1)
    columns = rng.normal(size=(4000, 3)) * [1.0, 10.0, 0.1]
    found = uncertainty(_sensitivity(columns, rng.normal(size=4000)), "abc", VALUES, BOUNDS)
    expected = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    errors = np.asarray([found.standard_error[name] for name in "abc"], float)
    np.testing.assert_allclose(errors, expected, rtol=0.2)
    assert not any(found.remark.values())


def test_a_residual_with_a_memory_widens_the_errors() -> None:
    """AR(1) with phi in residual and regressor: the variance grows by (1 + phi^2) / (1 - phi^2)."""
    rng = np.random.default_rng(2)
    phi, spread = 0.8, []
    expected = np.sqrt((1 + phi**2) / (1 - phi**2))
    for _ in range(20):
        noise = rng.normal(size=(4000, 2))
        series = np.zeros_like(noise)
        for k in range(1, len(noise)):
            series[k] = phi * series[k - 1] + noise[k]
        at = _sensitivity(series[:, :1], series[:, 1])
        error = uncertainty(at, "a", VALUES, BOUNDS).standard_error["a"]
        assert error is not None
        spread.append(error / (series[:, 1].std() / np.linalg.norm(series[:, 0])))
    assert np.mean(spread) == pytest.approx(expected, rel=0.15)


def test_three_parameters_of_which_the_runs_see_two_have_no_standard_error() -> None:
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(500, 3))
    columns[:, 2] = columns[:, 0] + columns[:, 1]
    found = uncertainty(_sensitivity(columns, rng.normal(size=500)), "abc", VALUES, BOUNDS)
    assert set(found.standard_error.values()) == {None}
    assert all("combination" in found.remark[name] for name in "abc")


def test_a_parameter_that_nothing_depends_on_is_said() -> None:
    rng = np.random.default_rng(4)
    columns = rng.normal(size=(500, 2)) * [1.0, 0.0]
    at = _sensitivity(columns, rng.normal(size=500))
    found = uncertainty(at, "ab", VALUES, BOUNDS)
    assert found.standard_error["b"] is None
    assert found.standard_error["a"] is not None
    assert any("b: nothing in these runs depends on it" in line for line in identifiability(at, "ab", BOUNDS))


def test_a_parameter_known_worse_than_its_range_has_no_standard_error() -> None:
    rng = np.random.default_rng(6)
    at = _sensitivity(rng.normal(size=(500, 2)) * [1.0, 1e-3], rng.normal(size=500))
    found = uncertainty(at, "ab", VALUES, BOUNDS)
    assert found.standard_error["b"] is None
    assert "range open" in found.remark["b"]


def test_a_parameter_on_its_bound_has_no_standard_error() -> None:
    rng = np.random.default_rng(5)
    at = _sensitivity(rng.normal(size=(500, 2)), rng.normal(size=500))
    found = uncertainty(at, "ab", {"a": 10.0, "b": 0.0}, BOUNDS)
    assert found.standard_error["a"] is None
    assert found.remark["a"] == "at its upper bound"
