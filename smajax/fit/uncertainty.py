"""Standard errors that allow for an autocorrelated residual, and which parameters have none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.core.correlation import correlation_of
from smajax.core.old_words import worded
from smajax.core.whiteness import WHITE, bartlett_sum, correlation_time, split_runs, whiteness_p_value
from smajax.fit.sensitivity import Sensitivity

# A fitted value nearer to a bound than this share of the range counts as at the bound, unless it is farther from it than so many
# standard errors with all else held, and so many with all else free: bounds of a friction go to 20 N m, and an arm's may be a
# thousandth of that.
AT_BOUND = 2e-3
CLEAR_OF_BOUND = 5.0
CLEAR_BESIDE_OTHERS = 2.0
ENDED = 1e-6  # of the range: a fit that ends so near to a bound was stopped by it
ORDERS_APART = 100.0  # bounds, one over the other, of a parameter whose size is what is unknown
# Two parameters whose estimates are correlated more than this: the runs determine one combination of them.
CORRELATED = 0.98
# A direction in which the scaled columns are shorter than this share of the longest is not identifiable. A parameter that
# changes by more than the second share of its standard error along such a direction, within the bounds, has none.
UNIDENTIFIABLE = 1e-5
MOVED = 0.1
# A standard error above this share of the prior's: the runs add nothing to the prior.
BARELY = 0.95
FEW = 50  # independent samples that determine a parameter


class RemarkKind(StrEnum):
    """What is to be said of an estimate beside its standard error."""

    NONE = ""
    LOWER_BOUND = "at its lower bound"
    UPPER_BOUND = "at its upper bound"
    NO_EFFECT = "no effect on these runs"
    COMBINATION = "combination"  # the runs determine one of it with others
    NOT_IDENTIFIABLE = "not identifiable"
    PRIOR = "determined by its prior; the runs add next to nothing"
    NOT_FINITE = "its variance is not finite"
    RANGE_OPEN = "the runs leave its whole range undetermined"
    CORRELATED = "correlated"


@dataclass(frozen=True)
class Remark:
    """A kind and, of a combination and of correlated ones, the other parameters."""

    kind: RemarkKind = RemarkKind.NONE
    others: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return self.kind is not RemarkKind.NONE

    @property
    def at_bound(self) -> bool:
        return self.kind in (RemarkKind.LOWER_BOUND, RemarkKind.UPPER_BOUND)

    @property
    def text(self) -> str:
        """In words; DeprecationWarning."""
        return str(worded("remark.text", "identifiability_words.remark_text(remark)", "remark_text", self))


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors (SI; None: not identifiable) and remarks, by parameter name; and groups of correlated ones."""

    standard_error: dict[str, float | None]
    remarks: dict[str, Remark]
    correlated_groups: tuple[tuple[str, ...], ...] = ()


def at_bound(value: float, low: float, high: float, edge: float = AT_BOUND) -> Remark:
    """At its lower bound, at its upper bound, or nothing (false); bounds that are orders of magnitude apart count by their logarithms."""
    if low > 0.0 and high > ORDERS_APART * low and value > 0.0:
        value, low, high = math.log(value), math.log(low), math.log(high)
    span = edge * (high - low)
    if value - low < span:
        return Remark(RemarkKind.LOWER_BOUND)
    return Remark(RemarkKind.UPPER_BOUND) if high - value < span else Remark()


def _covariance(
    columns: np.ndarray, priors: np.ndarray, runs: Sequence[np.ndarray], variance: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(covariance, scale of each column). A prior counts as one sample more, whose noise is one.

    That of least squares where the residual is white. Where it is autocorrelated, Newey-West's over each run, no
    variance below that of least squares; and where fewer than `FEW` independent samples determine a parameter, not below that of least
    sums_of_squares with no more samples than are independent: from so few Newey-West's comes out too small (by a factor of 2.7 in a
    coupon of 600 samples).
    """
    scale = np.linalg.norm(np.concatenate([columns, priors]), axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled, prior = columns / scale, priors / scale
    bread = np.linalg.pinv(scaled.T @ scaled + prior.T @ prior, rcond=1e-12, hermitian=True)
    before = bread @ (prior.T @ prior) @ bread  # zero without priors
    each = float(np.mean(np.concatenate(runs) ** 2)) if variance is None else variance
    plain = each * (bread - before) + before
    if variance is not None:
        return plain, scale
    if whiteness_p_value(runs) > WHITE:
        return plain, scale
    meat = np.zeros_like(bread)
    independent = correlation_time(runs)
    effective = (scaled**2).sum(axis=0) ** 2 / np.maximum((scaled**4).sum(axis=0), 1e-300)
    few = effective < FEW * independent
    floor = np.diag(np.where(few, independent, 1.0) * each * (bread - before) + before)
    reach = int(np.ceil(3.0 * independent))
    start = 0
    for run in runs:
        scores = scaled[start : start + len(run)] * run[:, None]
        start += len(run)
        # Weights that fall to zero within the lags taken: others make variances below zero.
        meat += bartlett_sum(scores, min(reach, len(run) // 4))
    sandwich = bread @ meat @ bread + before
    least = np.sqrt(np.maximum(floor, 0.0) / np.maximum(np.diag(sandwich), 1e-300))
    raised = np.maximum(least, 1.0)
    return sandwich * np.outer(raised, raised), scale


def _unidentifiable(scaled: np.ndarray) -> np.ndarray:
    """Directions that are not identifiable, (directions, parameters)."""
    _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(directions[singular <= UNIDENTIFIABLE * singular[:1]])


def _extents(directions: np.ndarray, scale: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """How far each parameter changes along those directions, (directions, parameters), until one has crossed its range."""
    extents = directions / scale
    longest = np.abs(extents / ranges).max(axis=1, keepdims=True, initial=0.0)
    return np.asarray(extents / np.where(longest > 0.0, longest, 1.0))


def clusters(covariance: np.ndarray) -> list[list[int]]:
    """Correlated estimates, directly or through another one, from their covariance or correlation (K, K): the indices of each group of two
    or more.

    Six correlated ones make fifteen pairs but one remark.
    """
    if not len(covariance):
        return []
    count, of = scipy.sparse.csgraph.connected_components(
        np.abs(correlation_of(covariance)) > CORRELATED, directed=False
    )
    clusters = [np.flatnonzero(of == cluster).tolist() for cluster in range(count)]
    return [cluster for cluster in clusters if len(cluster) > 1]


def _clear_of_bounds(
    at: Sensitivity,
    near: Sequence[str],
    free: Sequence[str],
    values: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    variance: float | None,
) -> set[str]:
    """Those of the parameters `near` a bound that the runs tell from it: with all else held, and with all else free."""
    told = set()
    for name in near:
        low, high = bounds[name]
        distance = min(values[name] - low, high - values[name])
        if distance <= ENDED * (high - low):
            continue
        alone, beside = _error(at, name, (), variance), _error(at, name, free, variance)
        if distance > CLEAR_OF_BOUND * alone > 0.0 and distance > CLEAR_BESIDE_OTHERS * beside > 0.0:
            told.add(name)
    return told


def _error(at: Sensitivity, name: str, others: Sequence[str], variance: float | None) -> float:
    """Standard error of `name` with `others` free; infinite where it has none."""
    own = [name, *others]
    covariance, scale = _covariance(at.columns(own), at.prior_columns(own), split_runs(at.misfit, at.mask), variance)
    found = float(covariance[0, 0])
    return math.sqrt(found) / float(scale[0]) if found > 0.0 and math.isfinite(found) else math.inf


def uncertainty(
    at: Sensitivity,
    names: Sequence[str],
    values: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    variance: float | None = None,
    edge: float = AT_BOUND,
) -> Uncertainty:
    """Standard errors at a fit. A parameter at its bound gets none, and those of the others take it as fixed.

    `variance` of a sample, over the noise's, in the place of the residual's; `edge`: share of the range that is at a bound.
    """
    remark = {name: at_bound(values[name], *bounds[name], edge) for name in names}
    near = [name for name in names if remark[name]]
    for name in _clear_of_bounds(at, near, [name for name in names if not remark[name]], values, bounds, variance):
        remark[name] = Remark()
    free = [name for name in names if not remark[name]]
    errors: dict[str, float | None] = dict.fromkeys(names)
    if not free:
        return Uncertainty(errors, remark)
    columns, priors = at.columns(free), at.prior_columns(free)
    covariance, scale = _covariance(columns, priors, split_runs(at.misfit, at.mask), variance)
    whole = np.concatenate([columns, priors])
    visible = np.any(whole, axis=0)
    ranges = np.asarray([bounds[name][1] - bounds[name][0] for name in free])
    directions = _unidentifiable(whole[:, visible] / scale[visible])
    extents = np.zeros((len(directions), len(free)))
    extents[:, visible] = _extents(directions, scale[visible], ranges[visible])
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for index, name in enumerate(free):
        without_effect = not visible[index]
        along = np.abs(extents[:, index]) > MOVED * error[index] / scale[index]
        unidentifiable = bool(along.any())
        finite = covariance[index, index] > 0.0 and np.isfinite(error[index])
        errors[name] = (
            float(error[index] / scale[index]) if finite and not without_effect and not unidentifiable else None
        )
        if without_effect:
            remark[name] = Remark(RemarkKind.NO_EFFECT)
        elif unidentifiable:
            farther = (np.abs(extents[along]) > MOVED * error / scale).any(axis=0)
            others = tuple(free[k] for k in np.flatnonzero(farther) if k != index)
            remark[name] = Remark(RemarkKind.COMBINATION if others else RemarkKind.NOT_IDENTIFIABLE, others)
        elif priors[:, index].any() and error[index] / scale[index] > BARELY / np.linalg.norm(priors[:, index]):
            remark[name] = Remark(RemarkKind.PRIOR)
        elif not finite:
            remark[name] = Remark(RemarkKind.NOT_FINITE)
    clear = [index for index, name in enumerate(free) if not remark[name]]
    for index, name in enumerate(free):
        if not remark[name] and error[index] / scale[index] > ranges[index]:
            errors[name], remark[name] = None, Remark(RemarkKind.RANGE_OPEN)
    groups = [tuple(free[clear[index]] for index in cluster) for cluster in clusters(covariance[np.ix_(clear, clear)])]
    for group in groups:
        for name in group:
            others = tuple(other for other in group if other != name)
            remark[name] = remark[name] or Remark(RemarkKind.CORRELATED, others)
    return Uncertainty(errors, remark, tuple(groups))


def covariance_of(
    at: Sensitivity, names: Sequence[str], known: Uncertainty, variance: float | None = None
) -> tuple[tuple[str, ...], np.ndarray]:
    """(parameters that have a standard error, their covariance, SI): the others are fixed at their values."""
    estimated = tuple(name for name in names if known.standard_error[name] is not None)
    if not estimated:
        return estimated, np.zeros((0, 0))
    runs = split_runs(at.misfit, at.mask)
    covariance, scale = _covariance(at.columns(estimated), at.prior_columns(estimated), runs, variance)
    return estimated, covariance / np.outer(scale, scale)
