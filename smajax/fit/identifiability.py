"""Which unknowns are identifiable from the runs, from the Jacobian alone, as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from smajax.core.correlation import correlation_of
from smajax.fit.sensitivity import Sensitivity
from smajax.fit.uncertainty import clusters

# A predicted standard error beyond this share of the range: the runs add nothing to the bounds.
UNDETERMINED = 0.25


class TakenAt(StrEnum):
    """Where the Jacobian was taken."""

    INITIAL_GUESS = "at the initial guess"
    BASE_FIT = "at the base model's fit"


@dataclass(frozen=True)
class CorrelatedGroup:
    """Parameters whose estimates are correlated, directly or through another one of them."""

    names: tuple[str, ...]
    most: float  # largest correlation of two of them, 0..1


@dataclass(frozen=True)
class Identifiability:
    """What the runs determine of the unknowns, with the noise alone: it holds only for a model that lacks no effect."""

    unknowns: tuple[str, ...]
    samples: int  # rows of the Jacobian, priors among them
    rank: int
    without_effect: tuple[str, ...] = ()  # nothing in the runs depends on them
    undetermined: tuple[str, ...] = ()  # the noise alone leaves more than `UNDETERMINED` of their range open
    correlated: tuple[CorrelatedGroup, ...] | None = None  # None: not looked at
    taken_at: TakenAt = TakenAt.INITIAL_GUESS


@dataclass(frozen=True)
class Checks:
    """What was found before a fit, beside the warnings of the experiment file."""

    identifiable: Identifiability
    unused_priors: bool = False  # the file gives priors that nothing here uses
    held_presets: tuple[str, ...] = ()  # values that the file does not give, held at those of the presets
    hidden_by_one_force: tuple[str, ...] = ()  # effects that only runs under another load could show
    freed_later: tuple[str, ...] = ()  # values that the file does not give, held here and fitted by what follows
    said_by_parameters: tuple[str, ...] = ()  # effects that parameters of the base model say which are fitted


def _correlated(covariance: np.ndarray, names: Sequence[str]) -> tuple[CorrelatedGroup, ...]:
    correlation = np.abs(correlation_of(covariance))
    groups = []
    for cluster in clusters(covariance):
        pairs = correlation[np.ix_(cluster, cluster)][np.triu_indices(len(cluster), 1)]
        groups.append(CorrelatedGroup(tuple(names[index] for index in cluster), float(pairs.max())))
    return tuple(groups)


def identifiability(
    at: Sensitivity,
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    taken_at: TakenAt = TakenAt.INITIAL_GUESS,
    *,
    correlations: bool = True,
) -> Identifiability:
    """Which of `names` are identifiable from these runs; `correlations`: and which are correlated.

    bounds: of each parameter, SI. taken_at: where the Jacobian of `at` was taken.
    """
    if not names:
        return Identifiability((), 0, 0, taken_at=taken_at)
    columns = np.concatenate([at.columns(names), at.prior_columns(names)])
    span = np.asarray([bounds[name][1] - bounds[name][0] for name in names])
    scaled = columns * span
    singular = np.linalg.svd(scaled, compute_uv=False)
    rank = int(np.sum(singular > 1e-8 * singular[0])) if singular[0] > 0.0 else 0
    seen = [index for index in range(len(names)) if np.any(columns[:, index])]
    visible = [names[index] for index in seen]
    undetermined: tuple[str, ...] = ()
    groups: tuple[CorrelatedGroup, ...] = ()
    if visible:
        picked = scaled[:, seen]
        covariance = np.linalg.pinv(picked.T @ picked, rcond=1e-14, hermitian=True)
        error = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        undetermined = tuple(name for name, value in zip(visible, error, strict=True) if value > UNDETERMINED)
        groups = _correlated(covariance, visible) if correlations else ()
    return Identifiability(
        unknowns=tuple(names),
        samples=len(scaled),
        rank=rank,
        without_effect=tuple(name for name in names if name not in visible),
        undetermined=undetermined,
        correlated=groups if correlations else None,
        taken_at=taken_at,
    )
