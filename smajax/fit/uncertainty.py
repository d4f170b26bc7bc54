"""Standard errors that know about residuals with a memory, and which parameters the runs cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from smajax.core.whiteness import WHITE, bartlett_sum, correlation_time, split_runs, whiteness_p_value
from smajax.core.wording import and_listed
from smajax.fit.sensitivity import Sensitivity

# A fitted value nearer to a bound than this share of the box counts as held by it.
AT_BOUND = 2e-3
# Two parameters whose estimates are correlated more than this move together: the runs see one combination of them.
TOGETHER = 0.98
# A direction in which the scaled columns are shorter than this share of the longest is one the runs do not see. One that a
# way through the whole box along such directions moves by more than this share of its standard error has none.
UNSEEN = 1e-5
MOVED = 0.1
# A predicted standard error beyond this share of the allowed box: the runs say nothing that the box does not.
VAGUE = 0.25
# A standard error above this share of the prior's: what is known of the parameter was known before.
BARELY = 0.95
FEW = 50  # independent samples that tell a parameter


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors (SI; None: not told by the runs) and remarks, by parameter name; and clusters that move together."""

    standard_error: dict[str, float | None]
    remark: dict[str, str]
    together: tuple[tuple[str, ...], ...] = ()


def held(value: float, low: float, high: float, edge: float = AT_BOUND) -> str:
    """`"at its lower bound"`, `"at its upper bound"`, or nothing."""
    span = edge * (high - low)
    return "at its lower bound" if value - low < span else "at its upper bound" if high - value < span else ""


def _covariance(
    columns: np.ndarray, priors: np.ndarray, runs: Sequence[np.ndarray], variance: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(covariance, scale of each column). A prior counts as one sample more, whose noise is one.

    That of least squares where the residual is white. Where it has a memory, Newey-West's over each run, no variance of
    it below that of least squares; and where fewer than `FEW` independent samples tell a parameter, not below that of least
    squares with no more samples than are independent: from so few Newey-West's comes out too small (by a factor of 2.7 in a
    coupon of 600 samples).
    """
    scale = np.linalg.norm(np.concatenate([columns, priors]), axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled, known = columns / scale, priors / scale
    bread = np.linalg.pinv(scaled.T @ scaled + known.T @ known, rcond=1e-12, hermitian=True)
    before = bread @ (known.T @ known) @ bread  # zero without priors
    each = float(np.mean(np.concatenate(runs) ** 2)) if variance is None else variance
    plain = each * (bread - before) + before
    if variance is not None:
        return plain, scale
    if whiteness_p_value(runs) > WHITE:
        return plain, scale
    meat = np.zeros_like(bread)
    independent = correlation_time(runs)
    telling = (scaled**2).sum(axis=0) ** 2 / np.maximum((scaled**4).sum(axis=0), 1e-300)
    few = telling < FEW * independent
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


def _unseen(scaled: np.ndarray) -> np.ndarray:
    """Directions that the runs do not see, (directions, parameters)."""
    _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(directions[singular <= UNSEEN * singular[:1]])


def _ways(unseen: np.ndarray, scale: np.ndarray, room: np.ndarray) -> np.ndarray:
    """How far each parameter goes along those directions, (directions, parameters), until one has crossed its box."""
    ways = unseen / scale
    longest = np.abs(ways / room).max(axis=1, keepdims=True, initial=0.0)
    return np.asarray(ways / np.where(longest > 0.0, longest, 1.0))


def _correlation(covariance: np.ndarray) -> np.ndarray:
    """Correlation matrix; zero where an estimate has no spread."""
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    error = np.where(error > 0.0, error, 1.0)
    return np.asarray(covariance / np.outer(error, error))


def _clusters(covariance: np.ndarray) -> list[list[int]]:
    """Estimates that move together, directly or through another one: the indices of each cluster of two or more.

    Six that move together make fifteen pairs but one remark.
    """
    if not len(covariance):
        return []
    count, of = connected_components(np.abs(_correlation(covariance)) > TOGETHER, directed=False)
    clusters = [np.flatnonzero(of == cluster).tolist() for cluster in range(count)]
    return [cluster for cluster in clusters if len(cluster) > 1]


def _together(name: str, cluster: Sequence[str]) -> str:
    """The remark of one of a cluster. Of a large one its first other member is named: enough to know it by."""
    others = [other for other in cluster if other != name]
    told = others if len(others) < 3 else [others[0], f"{len(others) - 1} others"]
    return f"moves together with {and_listed(told)}"


def uncertainty(
    at: Sensitivity,
    names: Sequence[str],
    values: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    variance: float | None = None,
    edge: float = AT_BOUND,
) -> Uncertainty:
    """Standard errors at a fit. A parameter held by its bound gets none, and the others are told with it fixed.

    `variance` of a sample, over the noise's, in the place of what the residual says; `edge`: how near is at a bound.
    """
    remark = {name: held(values[name], *bounds[name], edge) for name in names}
    loose = [name for name in names if not remark[name]]
    errors: dict[str, float | None] = dict.fromkeys(names)
    if not loose:
        return Uncertainty(errors, remark)
    columns, priors = at.columns(loose), at.prior_columns(loose)
    covariance, scale = _covariance(columns, priors, split_runs(at.misfit, at.mask), variance)
    whole = np.concatenate([columns, priors])
    seen = np.any(whole, axis=0)
    room = np.asarray([bounds[name][1] - bounds[name][0] for name in loose])
    lost_ways = _unseen(whole[:, seen] / scale[seen])
    ways = np.zeros((len(lost_ways), len(loose)))
    ways[:, seen] = _ways(lost_ways, scale[seen], room[seen])
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for index, name in enumerate(loose):
        blind = not seen[index]
        along = np.abs(ways[:, index]) > MOVED * error[index] / scale[index]
        lost = bool(along.any())
        known = covariance[index, index] > 0.0 and np.isfinite(error[index])
        errors[name] = float(error[index] / scale[index]) if known and not blind and not lost else None
        if blind:
            remark[name] = "no effect on these runs"
        elif lost:
            farther = (np.abs(ways[along]) > MOVED * error / scale).any(axis=0)
            others = [loose[k] for k in np.flatnonzero(farther) if k != index]
            remark[name] = (
                f"the runs see only a combination of it with {', '.join(others)}"
                if others
                else "the runs do not see it"
            )
        elif priors[:, index].any() and error[index] / scale[index] > BARELY / np.linalg.norm(priors[:, index]):
            remark[name] = "known from its prior; the runs add next to nothing"
        elif not known:
            remark[name] = "its variance comes out as no number"
    clear = [index for index, name in enumerate(loose) if not remark[name]]
    for index, name in enumerate(loose):
        if not remark[name] and error[index] / scale[index] > room[index]:
            errors[name], remark[name] = None, "the runs leave all of its range open"
    clusters = [
        tuple(loose[clear[index]] for index in cluster) for cluster in _clusters(covariance[np.ix_(clear, clear)])
    ]
    for members in clusters:
        for name in members:
            remark[name] = remark[name] or _together(name, members)
    return Uncertainty(errors, remark, tuple(clusters))


def covariance_of(
    at: Sensitivity, names: Sequence[str], known: Uncertainty, variance: float | None = None
) -> tuple[tuple[str, ...], np.ndarray]:
    """(parameters that have a standard error, their covariance, SI): the others are held at their values."""
    told = tuple(name for name in names if known.standard_error[name] is not None)
    if not told:
        return told, np.zeros((0, 0))
    runs = split_runs(at.misfit, at.mask)
    covariance, scale = _covariance(at.columns(told), at.prior_columns(told), runs, variance)
    return told, covariance / np.outer(scale, scale)


def _shown(rank: int, unknowns: int, samples: int) -> str:
    """How many of the unknowns leave a trace of their own in the runs."""
    how = f"(Jacobian of {samples} samples, rank {rank})"
    if rank == unknowns:
        return f"{f'All {unknowns} unknowns show' if unknowns > 1 else 'The one unknown shows'} in these runs {how}."
    if rank == 0:
        return f"No unknown shows in these runs {how}."
    return (
        f"Only {rank} combination{'' if rank == 1 else 's'} of the {unknowns} unknowns show{'s' if rank == 1 else ''} in "
        f"these runs {how}: standard errors of the ones that make up the rest mean nothing. "
        f"Fix {unknowns - rank} of them."
    )


def identifiability(at: Sensitivity, names: Sequence[str], bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """What these runs can and cannot tell about `names`, in sentences, before anything is fitted.

    From the Jacobian at the start values and the noise alone: it promises nothing about a model that lacks something.
    """
    if not names:
        return ["Nothing is declared unknown: the base model is taken as it is."]
    columns = np.concatenate([at.columns(names), at.prior_columns(names)])
    span = np.asarray([bounds[name][1] - bounds[name][0] for name in names])
    boxed = columns * span
    singular = np.linalg.svd(boxed, compute_uv=False)
    rank = int(np.sum(singular > 1e-8 * singular[0])) if singular[0] > 0.0 else 0
    told = [_shown(rank, len(names), len(boxed))]
    blind = [name for index, name in enumerate(names) if not np.any(columns[:, index])]
    told += [f"{name}: nothing in these runs depends on it; fix it or measure something else." for name in blind]
    if len(blind) > 0:
        told.append(
            "So it is where the search starts: a model that never transforms there shows nothing of its transformation. Where that "
            "surprises, look at the bench's sizes, the drive and the starts first."
        )
    seen = [name for name in names if name not in blind]
    if not seen:
        return told
    kept = boxed[:, [list(names).index(name) for name in seen]]
    covariance = np.linalg.pinv(kept.T @ kept, rcond=1e-14, hermitian=True)
    error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    vague = [name for name, value in zip(seen, error, strict=True) if value > VAGUE]
    told += [f"{name}: the noise alone leaves more than a quarter of its box open." for name in vague]
    correlation = np.abs(_correlation(covariance))
    for cluster in _clusters(covariance):
        pairs = correlation[np.ix_(cluster, cluster)][np.triu_indices(len(cluster), 1)]
        # Cut and not rounded: 0.9996 is not yet 1.
        most = np.floor(1e3 * float(pairs.max()) + 1e-6) / 1e3
        told.append(
            f"{and_listed([seen[index] for index in cluster])} move together in these runs (correlation up to {most:.3f}): "
            "fix one of them or measure runs that tell them apart."
        )
    if len(told) == 1 and 1 < len(names) == rank:
        told.append("The runs tell each of them from the others.")
    return told
