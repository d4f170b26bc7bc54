"""Score test: which effects would lower the misfit, by one Jacobian at the present fit, before any refit.

Each coefficient is looked at where it is switched off. The columns of the fitted parameters are projected out first:
what they can absorb is no evidence for an effect. What remains of the coefficient's column against what remains of the
residual gives the gain that a small coefficient would bring, its sign, and a p-value under the hypothesis that nothing
is missing: then the residual is noise, of as many independent samples as its autocorrelation leaves (`samples_per_independent`), and the
statistic is chi-square. Where something is missing every effect
that is not orthogonal to it stands out, so the p-value says *whether* something is missing, and not *what*.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.attribution.every_effect import EVERY
from smajax.core.whiteness import correlation_time, split_runs
from smajax.fit.sensitivity import Sensitivity


@dataclass(frozen=True)
class Score:
    """What the screening says of an effect."""

    effects: tuple[str, ...]
    gain: float  # share of the residual's square that the linear model would take away, 0..1
    p_value: float
    coefficients: dict[str, float]  # linear estimate by parameter name, inside its bounds


def switches(effect: str) -> tuple[str, ...]:
    """Parameter names of the coefficients that switch `effect` on."""
    return tuple(f"{effect}.{name}" for name in EVERY[effect].candidate.switches)


def score_of(
    names: tuple[str, ...],
    at: Sensitivity,
    basis: np.ndarray,
    residual: np.ndarray,
    bounds: Mapping[str, tuple[float, float]],
    correlation: float,
) -> Score:
    """Of an effect, in the residual and beside the directions of `without`; `correlation`: of `samples_per_independent`."""
    coefficients = [name for effect in names for name in switches(effect)]
    # misfit = measured - model: a coefficient lowers it along minus its derivative.
    columns = -at.columns(coefficients)
    columns = columns - basis @ (basis.T @ columns)
    low = np.asarray([bounds[name][0] for name in coefficients])
    high = np.asarray([bounds[name][1] for name in coefficients])
    # In shares of the box the columns are of a like size; a column that the fitted parameters absorb is left out.
    boxed = columns * (high - low)
    seen = np.linalg.norm(boxed, axis=0) > 1e-9
    found = np.zeros(len(coefficients))
    if seen.any():
        room = (high - low)[seen]
        lower, upper = np.minimum(low[seen] / room, 0.0), np.maximum(high[seen] / room, 0.0)
        solved = scipy.optimize.lsq_linear(boxed[:, seen], residual, bounds=(lower - 1e-12, upper + 1e-12))
        found[seen] = solved.x * room
    before = float(residual @ residual)
    after = residual - columns @ found
    gain = max(0.0, 1.0 - float(after @ after) / before) if before else 0.0
    statistic = gain * len(residual) / correlation  # in units of one independent sample's variance
    return Score(
        names,
        gain,
        float(scipy.stats.chi2.sf(statistic, max(1, int(seen.sum())))),
        dict(zip(coefficients, found.tolist(), strict=True)),
    )


def ranked(
    at: Sensitivity, fitted: Sequence[str], candidates: Sequence[str], bounds: Mapping[str, tuple[float, float]]
) -> list[Score]:
    """Every effect's score, the largest gain first. `fitted` are the loose parameters at the present fit."""
    basis, residual = without(at, fitted)
    correlation = samples_per_independent(at)
    scores = [score_of((name,), at, basis, residual, bounds, correlation) for name in candidates]
    return sorted(scores, key=lambda score: -score.gain)


def without(at: Sensitivity, fitted: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """(directions that the fitted parameters absorb, residual without them)."""
    residual = at.residual()
    basis = np.linalg.qr(scaled(at.columns(fitted)))[0] if fitted else np.zeros((len(residual), 0))
    return basis, residual - basis @ (basis.T @ residual)


def samples_per_independent(at: Sensitivity) -> float:
    """Samples per independent one, as far as noise accounts for them: an autocorrelated one is matched by a slow trace far more easily.

    What is larger than the noise is no noise, and its autocorrelation no reason for doubt.
    """
    noise = min(1.0, 1.0 / max(float(np.mean(at.residual() ** 2)), 1e-300))
    return 1.0 + noise * (correlation_time(split_runs(at.misfit, at.mask)) - 1.0)


def scaled(columns: np.ndarray) -> np.ndarray:
    """The columns that are not all zero, each of length one."""
    norm = np.linalg.norm(columns, axis=0)
    return columns[:, norm > 0.0] / norm[norm > 0.0]
