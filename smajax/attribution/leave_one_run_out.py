r"""Error on each run by a fit to the others, without a refit where one step is enough.

At the optimum of all runs, taking run r away moves the parameters by one Gauss-Newton step with the normal equations of the
others (infinitesimal jackknife; Giordano et al. 2019),

$$\delta = -(H - H_r)^{-1} g_r,\quad H = J^T J/s^2 + \Lambda,\ g_r = J_r^T r_r/s^2.$$

The run is then simulated at $\theta + \delta$, not extrapolated. Where the step makes the others worse by more than their
noise, or the run has no numbers there, it is too long to be believed, and those fits are made.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity

BELIEVED = 2.0  # by how much the others' sum of squares over the error may rise, twice the log-likelihood
MOST_PARTS = 12  # runs are left out one by one, or in so many parts
STEPS, TOLERANCE = 20, 1e-4  # of the refits


class LeftOut(NamedTuple):
    """What the fits without each part of the runs say."""

    misfit: np.ndarray  # SI, (series, N), of each run by the model without it; of a single run, by the fit to it
    values: np.ndarray  # (parts, P), parameters of the problem whose joint fit it is, without each part of the runs


def left_out(joint: JointParameters, model: FittedModel, error: float, program: Sequence[str] | None = None) -> LeftOut:
    """Each run by the model without it.

    `error`: of an independent sample, SI. `program`: effects of the program that computes it; None: the model's own.
    """
    problem, index = joint.restricted(model.effects if program is None else program)
    problem = problem.with_noise(error)
    values = model.values[index]
    runs = problem.batch.runs
    whole = misfits(problem, [values])[0]
    if runs < 2 or not model.names:
        return LeftOut(whole, model.values[None])
    parts = np.arange(runs) % min(runs, MOST_PARTS)
    owner = parts[problem.owner]
    points = _steps(joint, problem, model, values, owner)
    found = misfits(problem, points)
    others = np.asarray([_cost(one, error, owner != part) for part, one in enumerate(found)])
    before = np.asarray([_cost(whole, error, owner != part) for part in range(len(points))])
    # Where the run itself has no numbers there, the fit is made: it goes nowhere where a run has none.
    numbers = np.asarray([np.isfinite(one[owner == part]).all() for part, one in enumerate(found)])
    doubtful = np.flatnonzero(~(others < before + BELIEVED) | ~numbers)
    if doubtful.size:
        tasks = [problem.task(model.names, joint.bounds, values, (parts != part).astype(float)) for part in doubtful]
        fits = levenberg_marquardt(problem, tasks, FitSettings(max_steps=STEPS, tolerance=TOLERANCE))
        found[doubtful] = misfits(problem, [fit.values for fit in fits])
        for part, fit in zip(doubtful, fits, strict=True):
            points[part] = fit.values
    every = np.tile(model.values, (len(points), 1))
    every[:, index] = np.stack(points)
    if any(part >= 0 for part in _own(problem, model.names, owner)):
        found = misfits(problem, _with_own_values_fitted(joint, problem, model, points, parts))
    return LeftOut(np.stack([found[part, series] for series, part in enumerate(owner)]), every)


class LeftOfOthers(NamedTuple):
    """What a model leaves of the other runs without each of `groups`, root mean squares, SI, each by one Gauss-Newton step."""

    groups: list[tuple[int, ...]]  # runs that are left out
    before: np.ndarray  # fitted to all runs
    after: np.ndarray  # fitted to the others alone


def left_of_the_others(
    joint: JointParameters, model: FittedModel, error: float, program: Sequence[str], most: int = 1
) -> tuple[float, list[LeftOfOthers]]:
    """(root mean square that `model` would leave of all runs, fitted to all; what without each run in turn, without each two, and so on up to `most` at once).

    Both by one Gauss-Newton step of what `joint` has free, which may be more than the model was fitted with. `error` and `program` as of `left_out`; SI.
    """
    problem, index = joint.restricted(program)
    problem = problem.with_noise(error)
    gram, gradient, misfit = _normal_equations(problem, model, model.values[index])
    squares, samples = problem.by_run(misfit**2).sum(axis=1), problem.by_run(np.asarray(problem.batch.mask)).sum(axis=1)
    prior = np.diag(model.precision)

    def step_to(series: np.ndarray) -> np.ndarray:
        return np.asarray(np.linalg.solve(gram[series].sum(axis=0) + prior, gradient[series].sum(axis=0)))

    def mean_square(step: np.ndarray, runs: Sequence[int]) -> float:
        series = np.isin(problem.owner, runs)
        lower = 2.0 * float(step @ gradient[series].sum(axis=0)) - float(step @ gram[series].sum(axis=0) @ step)
        return max(squares[runs].sum() - lower, 0.0) / float(samples[runs].sum())

    every = list(range(problem.batch.runs))
    to_all = step_to(np.ones(len(problem.owner), bool))
    found = []
    for together in range(1, most + 1):
        groups = list(itertools.combinations(every, together))
        before, after = [], []
        for gone in groups:
            stay = [run for run in every if run not in gone]
            before.append(mean_square(to_all, stay))
            after.append(mean_square(step_to(~np.isin(problem.owner, gone)), stay))
        found.append(LeftOfOthers(groups, error * np.sqrt(before), error * np.sqrt(after)))
    return error * float(np.sqrt(mean_square(to_all, every))), found


def predicting(
    joint: JointParameters, fitted: FittedModel, error: float, noise: float, program: Sequence[str] | None = None
) -> Model:
    """A fitted model with its error on each run by the others; `noise` of a sample, SI, the rest as of `left_out`."""
    found = left_out(joint, fitted, error, program)
    rmse = float(np.sqrt((found.misfit**2).sum() / np.asarray(joint.problem.batch.mask).sum()))
    cost, factors = fitted.squares / noise**2, fitted.width_factors
    return Model(fitted.effects, fitted.values, cost, found.misfit, rmse, found.values, factors)


def jackknife_error(values: np.ndarray) -> np.ndarray:
    """Standard error of each parameter by how far it moves when a part of the runs is left out; `values` (parts, P)."""
    parts = len(values)
    return np.asarray(np.sqrt((parts - 1) / parts * ((values - values.mean(axis=0)) ** 2).sum(axis=0)))


def _steps(
    joint: JointParameters, problem: Problem, model: FittedModel, values: np.ndarray, owner: np.ndarray
) -> list[np.ndarray]:
    """The parameters (P,) without each part of the runs, within their bounds. `owner`: the part of each series."""
    gram, gradient, _ = _normal_equations(problem, model, values)
    precision = np.diag(model.precision)
    slots = [problem.names.index(name) for name in model.names]
    low, high = np.asarray([joint.bounds[name] for name in model.names]).T
    # A run's own value stays: without the run nothing says what it is.
    own = _own(problem, model.names, owner)
    points = []
    for part in range(owner.max() + 1):
        others = gram[owner != part].sum(axis=0) + precision
        step = -np.linalg.solve(others, gradient[owner == part].sum(axis=0)) * model.scales
        point = np.array(values)
        point[slots] = np.clip(point[slots] + np.where(own == part, 0.0, step), low, high)
        points.append(point)
    return points


def _normal_equations(
    problem: Problem, model: FittedModel, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(J^T J, J^T r, r) of each series at `values` (P,) by the free parameters of `model`, in widths of their priors; in errors of `problem`."""
    at = sensitivity(problem, values, model.names)
    columns = -at.jacobian * model.scales
    return np.einsum("snp,snq->spq", columns, columns), np.einsum("snp,sn->sp", columns, at.misfit), at.misfit


def _own(problem: Problem, names: Sequence[str], owner: np.ndarray) -> np.ndarray:
    """Of each of `names` the part of the runs whose own value it is, -1 of a shared one; `owner`: the part of each series."""
    part = owner[:: len(problem.batch.outputs)]
    of_runs = np.repeat(part, len(problem.per_run.names)).tolist()
    run_of = dict(zip(problem.per_run.full_names, of_runs, strict=True))
    return np.asarray([run_of.get(name, -1) for name in names], dtype=int)


def _with_own_values_fitted(
    joint: JointParameters, problem: Problem, model: FittedModel, points: Sequence[np.ndarray], parts: np.ndarray
) -> list[np.ndarray]:
    """`points` (P,) without each part of the runs, with the own values of its runs fitted to them, as of a run that is held out."""
    own = _own(problem, model.names, parts[problem.owner])
    with_some = [part for part in range(len(points)) if part in own]
    tasks = [
        problem.task(
            [name for name, whose in zip(model.names, own, strict=True) if whose == part],
            joint.bounds,
            points[part],
            (parts == part).astype(float),
        )
        for part in with_some
    ]
    fits = levenberg_marquardt(problem, tasks, FitSettings(max_steps=STEPS, tolerance=TOLERANCE))
    result = list(points)
    for part, fit in zip(with_some, fits, strict=True):
        result[part] = fit.values
    return result


def _cost(misfit: np.ndarray, error: float, series: np.ndarray) -> float:
    return float(np.nan_to_num((misfit[series] ** 2).sum() / error**2, nan=np.inf))
