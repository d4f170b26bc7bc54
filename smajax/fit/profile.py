"""Profile likelihood: a parameter fixed at values beside its estimate, all others fitted again at each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.problem import Problem

ERRORS = (-2.8, -2.1, -1.4, -0.7, 0.7, 1.4, 2.1, 2.8)  # standard errors from the estimate
SPARE = 0.1  # share of the range, for a parameter that has no standard error
EQUAL_COST = 0.1  # rise of the cost, in variances of an independent sample, up to which two fits are the same minimum
WITHIN = 1.959964  # square root of the 95 % point of chi-square with one degree of freedom


@dataclass(frozen=True)
class Profile:
    """One parameter: values (K,) in order, the estimate among them, and the rise of the cost there."""

    name: str
    values: np.ndarray
    rise: np.ndarray  # over the least, in units of the variance of an independent sample
    low: float | None  # 95 % interval; None: not reached by the last value, which may be the bound
    high: float | None
    better: bool  # whether the cost is lower somewhere than at the fit


def _crossing(values: np.ndarray, root: np.ndarray) -> float | None:
    """Where the root of the rise reaches `WITHIN`, going outwards from the estimate, by straight lines."""
    beyond = np.flatnonzero(root >= WITHIN)
    if not len(beyond) or beyond[0] == 0:
        return None
    k = beyond[0]
    return float(np.interp(WITHIN, root[k - 1 : k + 1], values[k - 1 : k + 1]))


def _parts(problem: Problem, fit: Fit) -> tuple[float, float]:
    """(squares of the runs' residuals, of the priors')."""
    prior = float(np.sum(np.square(problem.priors.rows(fit.values))))
    return fit.cost - prior, prior


def profiles(
    problem: Problem,
    requested: Sequence[str],
    names: Sequence[str],
    bounds: Mapping[str, tuple[float, float]],
    best: Fit,
    errors: Mapping[str, float | None],
    inflation: float,
    settings: FitSettings | None = None,
) -> tuple[Profile, ...]:
    """Profiles of the parameters `requested`, which are among the fitted `names`; `best` is their fit."""
    settings = settings or FitSettings(stage="profiles")
    index = problem.names.index
    tasks, points = [], []
    for name in requested:
        low, high = bounds[name]
        error = errors[name] or SPARE * (high - low)
        others = [other for other in names if other != name]
        here = float(best.values[index(name)])
        for value in sorted({min(max(here + share * error, low), high) for share in ERRORS} - {here}):
            start = np.array(best.values)
            start[index(name)] = value
            tasks.append(problem.task(others, bounds, start))
            points.append((name, value))
    solved = levenberg_marquardt(problem, tasks, settings) if tasks else []
    drawn, (least, least_prior) = [], _parts(problem, best)
    for name in requested:
        tried = [(value, *_parts(problem, one)) for (of, value), one in zip(points, solved, strict=True) if of == name]
        tried = sorted([*tried, (float(best.values[index(name)]), least, least_prior)])
        values, cost, prior = np.asarray(tried).T
        # A prior is as narrow as it was declared, whatever the residual's noise turns out to be.
        rise = (cost - least) / inflation + prior - least_prior
        middle = int(np.argmin(np.abs(values - best.values[index(name)])))
        root = np.sqrt(np.maximum(rise, 0.0))
        down = _crossing(values[middle::-1], root[middle::-1])
        up = _crossing(values[middle:], root[middle:])
        drawn.append(Profile(name, values, rise, down, up, bool(rise.min() < -EQUAL_COST)))
    return tuple(drawn)
