"""Standard errors: right where a parameter is identifiable, none where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from smajax.fit.identifiability import identifiability
from smajax.fit.sensitivity import Sensitivity
from smajax.fit.uncertainty import Remark, RemarkKind, at_bound, uncertainty

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
    assert not any(found.remarks.values())


def test_an_autocorrelated_residual_widens_the_errors() -> None:
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


def test_three_parameters_of_which_two_combinations_are_identifiable_have_no_standard_error() -> None:
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(500, 3))
    columns[:, 2] = columns[:, 0] + columns[:, 1]
    found = uncertainty(_sensitivity(columns, rng.normal(size=500)), "abc", VALUES, BOUNDS)
    assert set(found.standard_error.values()) == {None}
    assert all(found.remarks[name].kind is RemarkKind.COMBINATION for name in "abc")
    assert found.remarks["a"].others == ("b", "c")


def test_a_parameter_without_influence_is_reported() -> None:
    rng = np.random.default_rng(4)
    columns = rng.normal(size=(500, 2)) * [1.0, 0.0]
    at = _sensitivity(columns, rng.normal(size=500))
    found = uncertainty(at, "ab", VALUES, BOUNDS)
    assert found.standard_error["b"] is None
    assert found.standard_error["a"] is not None
    assert identifiability(at, "ab", BOUNDS).without_effect == ("b",)


def test_a_parameter_known_worse_than_its_range_has_no_standard_error() -> None:
    rng = np.random.default_rng(6)
    at = _sensitivity(rng.normal(size=(500, 2)) * [1.0, 1e-3], rng.normal(size=500))
    found = uncertainty(at, "ab", VALUES, BOUNDS)
    assert found.standard_error["b"] is None
    assert found.remarks["b"].kind is RemarkKind.RANGE_OPEN


def test_a_parameter_on_its_bound_has_no_standard_error() -> None:
    rng = np.random.default_rng(5)
    at = _sensitivity(rng.normal(size=(500, 2)), rng.normal(size=500))
    found = uncertainty(at, "ab", {"a": 10.0, "b": 0.0}, BOUNDS)
    assert found.standard_error["a"] is None
    assert found.remarks["a"].kind is RemarkKind.UPPER_BOUND


@pytest.mark.parametrize(
    ("size", "kind"), [(2.5e-3, RemarkKind.NONE), (2e-5, RemarkKind.LOWER_BOUND), (0.0, RemarkKind.LOWER_BOUND)]
)
def test_a_small_size_that_the_runs_tell_from_zero_is_not_at_its_bound(size: float, kind: RemarkKind) -> None:
    """A friction of 0.0025 N m within 0 to 20: a thousandth of the range, and a hundred standard errors from zero."""
    random = np.random.default_rng(3)
    columns = np.stack([random.normal(size=1600) * 1e3, np.ones(1600)], axis=1)  # errors of 2.5e-5 and 0.025
    found = uncertainty(
        _sensitivity(columns, random.normal(size=1600)),
        ("a", "b"),
        {"a": size, "b": 3.0},
        {"a": (0.0, 20.0), "b": (-9.0, 9.0)},
    )
    assert found.remarks["a"].kind is kind
    assert (found.standard_error["a"] is None) == (kind is RemarkKind.LOWER_BOUND)


def test_a_small_size_that_another_parameter_may_take_over_is_at_its_bound() -> None:
    """Fifty standard errors from zero with the other held, half of one with it free."""
    random = np.random.default_rng(3)
    first = random.normal(size=1600) * 1e3
    columns = np.stack([first, 0.1 * (first + 3.0 * random.normal(size=1600))], axis=1)
    found = uncertainty(
        _sensitivity(columns, random.normal(size=1600)),
        ("a", "b"),
        {"a": 1.25e-3, "b": 3.0},
        {"a": (0.0, 20.0), "b": (-9.0, 9.0)},
    )
    assert found.remarks["a"].kind is RemarkKind.LOWER_BOUND


def _estimates_with(covariance: np.ndarray, seed: int, samples: int = 4000) -> Sensitivity:
    """Runs in which the estimates of a, b, c, ... have this covariance, with white noise of one left."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(samples, len(covariance))))[0]
    jacobian = basis @ np.linalg.inv(np.linalg.cholesky(covariance))
    names = tuple("abcdef"[: len(covariance)])
    return Sensitivity(names, rng.normal(size=(1, samples)), jacobian[None], np.ones((1, samples)))


def _groups(at: Sensitivity) -> tuple[dict[tuple[str, ...], float], dict[str, Remark]]:
    """(largest correlation of each group of correlated parameters, remarks)."""
    bounds = dict.fromkeys(at.names, (-100.0, 100.0))
    found = identifiability(at, at.names, bounds)
    assert (found.rank, found.samples) == (len(at.names), 4000)
    assert found.correlated is not None
    remarks = uncertainty(at, at.names, dict.fromkeys(at.names, 1.0), bounds).remarks
    return {one.names: one.most for one in found.correlated}, remarks


def test_two_correlated_pairs_are_found_with_their_correlations() -> None:
    covariance = np.eye(5)
    covariance[0, 1] = covariance[1, 0] = 0.995
    covariance[3, 4] = covariance[4, 3] = -0.9996
    groups, remarks = _groups(_estimates_with(covariance, 7))
    assert groups == pytest.approx({("a", "b"): 0.995, ("d", "e"): 0.9996}, abs=1e-6)
    others = {"a": ("b",), "b": ("a",), "d": ("e",), "e": ("d",)}
    assert remarks == {"c": Remark(), **{name: Remark(RemarkKind.CORRELATED, one) for name, one in others.items()}}


def test_groups_of_correlated_parameters_are_separated() -> None:
    covariance = np.kron(np.eye(2), np.asarray([[1.0, 0.999], [0.999, 1.0]]))
    at = _estimates_with(covariance, 9)
    bounds = dict.fromkeys(at.names, (-1e6, 1e6))
    found = uncertainty(at, at.names, dict.fromkeys(at.names, 1.0), bounds)
    assert found.correlated_groups == (("a", "b"), ("c", "d"))
    assert found.remarks["a"] == Remark(RemarkKind.CORRELATED, ("b",))


def test_six_correlated_parameters_are_one_group() -> None:
    groups, remarks = _groups(_estimates_with(0.01 * np.eye(6) + 0.99, 8))
    assert groups == pytest.approx({tuple("abcdef"): 0.99}, abs=1e-6)
    assert remarks == {
        name: Remark(RemarkKind.CORRELATED, tuple(one for one in "abcdef" if one != name)) for name in "abcdef"
    }


def test_a_chain_is_one_group_though_its_ends_differ() -> None:
    """A random walk from a to d: each estimate goes with the next one, a and d less than the limit."""
    steps = np.tril(np.ones((4, 4))) * [1.0, 0.15, 0.15, 0.15]
    covariance = steps @ steps.T
    assert covariance[0, 3] / np.sqrt(covariance[3, 3]) < 0.98
    groups, _ = _groups(_estimates_with(covariance, 9))
    assert list(groups) == [tuple("abcd")]


def test_correlations_beside_a_combination_without_effect_are_those_of_the_others() -> None:
    at = _estimates_with(np.asarray([[1.0, 0.995], [0.995, 1.0]]), 7)
    jacobian = np.concatenate([at.jacobian, np.zeros((1, at.jacobian.shape[1], 1))], axis=2)
    found = identifiability(Sensitivity(("a", "b", "c"), at.misfit, jacobian, at.mask), "abc", BOUNDS)
    assert (found.rank, found.without_effect) == (2, ("c",))
    assert found.correlated is not None
    (group,) = found.correlated
    assert group.names == ("a", "b")
    assert group.most == pytest.approx(0.995, abs=1e-6)


@pytest.mark.parametrize(("names", "rank"), [("a", 0), ("a", 1), ("ab", 2), ("abc", 2)])
def test_the_number_of_identifiable_unknowns_is_the_rank(names: str, rank: int) -> None:
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(500, rank)) @ np.eye(rank, len(names))
    columns[:, rank:] = columns[:, :1] if rank else 0.0
    found = identifiability(_sensitivity(columns, rng.normal(size=500)), names, BOUNDS)
    assert (found.unknowns, found.rank, found.samples) == (tuple(names), rank, 500)


def test_a_weak_parameter_within_a_degeneracy_has_no_error_either() -> None:
    """Its column is short beside those of the others: the direction that is not identifiable changes it all the same."""
    rng = np.random.default_rng(11)
    columns = rng.normal(size=(400, 3)) * [1.0, 0.02, 1.0]
    columns[:, 2] = columns[:, 0] + columns[:, 1]  # (1, 1, -1) has no effect
    found = uncertainty(_sensitivity(columns, 1e-3 * rng.normal(size=400)), "abc", VALUES, BOUNDS)
    assert set(found.standard_error.values()) == {None}


def test_no_variance_of_an_autocorrelated_residual_is_below_zero() -> None:
    rng = np.random.default_rng(12)
    for _ in range(300):
        columns = rng.normal(size=(24, 2))
        residual = rng.normal(size=24)
        for k in range(1, 24):
            residual[k] += 0.95 * residual[k - 1]
        errors = uncertainty(_sensitivity(columns, residual), "ab", VALUES, BOUNDS).standard_error
        assert all(error is None or error > 0.0 for error in errors.values())


def test_few_independent_samples_make_no_small_error() -> None:
    """A coupon of 240 samples with an autocorrelated residual: a slow column has no more information than its independent samples."""
    rng = np.random.default_rng(13)
    column = np.linspace(-1.0, 1.0, 240)[:, None]
    z = []
    for _ in range(200):
        noise = rng.normal(size=240)
        for k in range(1, 240):
            noise[k] += 0.8 * noise[k - 1]
        estimate = float(column[:, 0] @ noise / (column[:, 0] @ column[:, 0]))
        error = uncertainty(_sensitivity(column, noise), "a", VALUES, BOUNDS).standard_error["a"]
        assert error is not None
        z.append(estimate / error)
    assert 0.9 < np.mean(np.abs(z) < 1.96) <= 1.0


@pytest.mark.parametrize(
    ("value", "low", "high", "kind"),
    [
        (1.0, 0.05, 8000.0, RemarkKind.NONE),  # a damping, far above its lower bound by any measure but the range's
        (0.05, 0.05, 8000.0, RemarkKind.LOWER_BOUND),
        (7999.0, 0.05, 8000.0, RemarkKind.UPPER_BOUND),
        (30.5, 30.0, 600.0, RemarkKind.LOWER_BOUND),
        (1.0, 0.0, 8000.0, RemarkKind.LOWER_BOUND),  # zero has no logarithm
        (0.5, -1.0, 1.0, RemarkKind.NONE),
    ],
)
def test_bounds_that_are_orders_of_magnitude_apart_count_by_their_logarithms(
    value: float, low: float, high: float, kind: RemarkKind
) -> None:
    assert at_bound(value, low, high).kind is kind
