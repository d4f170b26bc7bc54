"""Standard errors that know about residuals with a memory, and which parameters the runs cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.fit.bounds import AT_BOUND
from smajax.fit.sensitivity import Sensitivity
from smajax.residual.noise_like import correlation_time, split_runs

# Two parameters whose estimates are correlated more than this move together: the runs see one combination of them.
TOGETHER = 0.98
# A direction in which the scaled columns are shorter than this share of the longest is one the runs do not see; a
# parameter with more than `SHARE` of its own in such directions has no standard error.
UNSEEN = 1e-5
SHARE = 0.1
# A predicted standard error beyond this share of the allowed box: the runs say nothing that the box does not.
VAGUE = 0.25


@dataclass(frozen=True)
class Uncertainty:
    """Standard errors (SI; None: not told by the runs) and remarks, by parameter name."""

    standard_error: dict[str, float | None]
    remark: dict[str, str]


def held(value: float, low: float, high: float) -> str:
    """`"at its lower bound"`, `"at its upper bound"`, or nothing."""
    span = AT_BOUND * (high - low)
    return "at its lower bound" if value - low < span else "at its upper bound" if high - value < span else ""


def _covariance(columns: np.ndarray, runs: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(sandwich covariance, scale of each column). Newey-West over each run, so memory in the residual is paid for."""
    scale = np.linalg.norm(columns, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    scaled = columns / scale
    bread = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    meat = np.zeros_like(bread)
    reach = int(np.ceil(3.0 * correlation_time(runs)))
    start = 0
    for run in runs:
        scores = scaled[start : start + len(run)] * run[:, None]
        start += len(run)
        meat += scores.T @ scores
        for lag in range(1, min(reach, len(run) // 4) + 1):
            cross = scores[:-lag].T @ scores[lag:]
            meat += (1.0 - lag / (reach + 1.0)) * (cross + cross.T)
    return bread @ meat @ bread, scale


def _unseen(scaled: np.ndarray) -> np.ndarray:
    """Projector on the directions that the runs do not see, (parameters, parameters)."""
    _, singular, directions = np.linalg.svd(scaled, full_matrices=False)
    unseen = directions[singular <= UNSEEN * singular[:1]]
    return np.asarray(unseen.T @ unseen)


def uncertainty(
    at: Sensitivity, names: Sequence[str], values: Mapping[str, float], bounds: Mapping[str, tuple[float, float]]
) -> Uncertainty:
    """Standard errors at a fit. A parameter held by its bound gets none, and the others are told with it fixed."""
    remark = {name: held(values[name], *bounds[name]) for name in names}
    loose = [name for name in names if not remark[name]]
    errors: dict[str, float | None] = dict.fromkeys(names)
    if not loose:
        return Uncertainty(errors, remark)
    columns = at.columns(loose)
    covariance, scale = _covariance(columns, split_runs(at.misfit, at.mask))
    seen = np.any(columns, axis=0)
    unseen = np.zeros((len(loose), len(loose)))
    unseen[np.ix_(seen, seen)] = _unseen(columns[:, seen] / scale[seen])
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for index, name in enumerate(loose):
        blind = not seen[index]
        lost = unseen[index, index] > SHARE**2
        errors[name] = None if blind or lost else float(error[index] / scale[index])
        if blind:
            remark[name] = "no effect on these runs"
        elif lost:
            others = [loose[k] for k in np.flatnonzero(np.abs(unseen[index]) > SHARE**2) if k != index]
            remark[name] = f"the runs see only a combination of it with {', '.join(others)}"
    for index, name in enumerate(loose):
        room = bounds[name][1] - bounds[name][0]
        if not remark[name] and error[index] / scale[index] > room:
            errors[name], remark[name] = None, "the runs leave all of its range open"
    correlation = covariance / np.outer(np.where(error > 0, error, 1.0), np.where(error > 0, error, 1.0))
    for index, name in enumerate(loose):
        partners = [loose[k] for k in np.flatnonzero(np.abs(correlation[index]) > TOGETHER) if k != index]
        if partners and not remark[name]:
            remark[name] = f"moves together with {', '.join(partners)}"
    return Uncertainty(errors, remark)


def identifiability(at: Sensitivity, names: Sequence[str], bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """What these runs can and cannot tell about `names`, in sentences, before anything is fitted.

    From the Jacobian at the start values and the noise alone: it promises nothing about a model that lacks something.
    """
    if not names:
        return ["Nothing is declared unknown: the base model is taken as it is."]
    columns = at.columns(names)
    span = np.asarray([bounds[name][1] - bounds[name][0] for name in names])
    boxed = columns * span
    singular = np.linalg.svd(boxed, compute_uv=False)
    rank = int(np.sum(singular > 1e-8 * singular[0])) if singular[0] > 0.0 else 0
    told = [f"The Jacobian of {len(boxed)} samples by {len(names)} unknowns has rank {rank}."]
    if rank < len(names):
        told.append(
            f"Only {rank} combination(s) of the {len(names)} unknowns show in these runs: standard errors of the ones that "
            "make up the rest mean nothing. Fix one of them."
        )
    blind = [name for index, name in enumerate(names) if not np.any(columns[:, index])]
    told += [f"{name}: nothing in these runs depends on it; fix it or measure something else." for name in blind]
    seen = [name for name in names if name not in blind]
    if not seen:
        return told
    kept = boxed[:, [list(names).index(name) for name in seen]]
    covariance = np.linalg.pinv(kept.T @ kept, rcond=1e-14, hermitian=True)
    error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    vague = [name for name, value in zip(seen, error, strict=True) if value > VAGUE]
    told += [f"{name}: the noise alone leaves more than a quarter of its box open." for name in vague]
    correlation = covariance / np.outer(error, error)
    for i, first in enumerate(seen):
        for j in range(i + 1, len(seen)):
            if abs(correlation[i, j]) > TOGETHER:
                told.append(
                    f"{first} and {seen[j]} move together (correlation {correlation[i, j]:+.3f}): trust their combination, not each."
                )
    if len(told) == 1 and rank == len(names):
        told.append("Each unknown shows in the runs by itself.")
    return told
