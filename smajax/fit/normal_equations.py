"""Cost of fits at points, and with derivatives their normal equations: of many fits at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smajax.fit.outputs_of_runs import predicted_and_derivatives, predicted_at
from smajax.fit.priors import Priors
from smajax.fit.problem import FitTask, Problem

NormalEquations = tuple[float, np.ndarray, np.ndarray]  # r^T r, J^T r, J^T J of one fit, by shares of its range


def _weight(problem: Problem, task: FitTask) -> np.ndarray:
    """Of the misfits of every series, (series, 1)."""
    return np.repeat(np.sqrt(task.weights), len(problem.batch.outputs))[:, None] / np.asarray(problem.noise)


def _with_weight(tasks: Sequence[FitTask]) -> np.ndarray:
    """Which runs each task does not leave out, (tasks, R)."""
    return np.stack([task.weights > 0.0 for task in tasks])


def _residual(
    problem: Problem, task: FitTask, y: np.ndarray, point: np.ndarray, predicted: np.ndarray, measured: np.ndarray
) -> np.ndarray:
    """Misfits over the noise, priors and regularisation of a task at its y, (m,)."""
    with np.errstate(over="ignore", invalid="ignore"):  # a step to where a load jumps: it will be rejected
        misfits = _weight(problem, task) * problem.centred(measured - predicted)
    drift = task.regularisation * (y - task.initial_guess)
    return np.concatenate([misfits.ravel(), _priors(problem, task).rows(point), drift])


def _priors(problem: Problem, task: FitTask) -> Priors:
    return problem.priors if task.priors is None else task.priors


def _misfit_by_series(problem: Problem, task: FitTask, residual: np.ndarray) -> np.ndarray:
    """Root mean square misfit on each series, SI, from `_residual`; nan of a run without weight."""
    weight, shape = _weight(problem, task), problem.measured.shape
    samples = (np.asarray(problem.batch.mask) > 0.0).sum(axis=1)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        misfits = residual[: problem.measured.size].reshape(shape) / weight
        return np.sqrt(np.sum(misfits**2, axis=1) / samples) / problem.scale_of_series[:, 0]


def costs(
    problem: Problem, tasks: Sequence[FitTask], ys: Sequence[np.ndarray], outputs: np.ndarray | None
) -> list[float]:
    """r^T r of every task at its y."""
    points = np.stack([task.values_at(y) for task, y in zip(tasks, ys, strict=True)])
    measured = [problem.measured] * len(tasks) if outputs is None else outputs
    found = []
    for one in zip(tasks, ys, points, predicted_at(problem, points), measured, strict=True):
        value = _residual(problem, *one)
        with np.errstate(over="ignore", invalid="ignore"):
            found.append(float(value @ value))
    return found


def normal_equations(
    problem: Problem, tasks: Sequence[FitTask], ys: Sequence[np.ndarray], outputs: np.ndarray | None
) -> list[tuple[NormalEquations, np.ndarray]]:
    """Of every task at its y, with its root mean square misfit on each series, SI. Directions of all tasks go side by side, whatever each of them frees."""
    points = np.stack([task.values_at(y) for task, y in zip(tasks, ys, strict=True)])
    most = max(1, *(len(task.slots) for task in tasks))
    tangents = np.zeros((len(tasks), most, points.shape[1]))
    for rows, task in zip(tangents, tasks, strict=True):
        rows[np.arange(len(task.slots)), task.slots] = task.high - task.low
    predicted, derivatives = predicted_and_derivatives(problem, points, tangents, _with_weight(tasks))
    measured = [problem.measured] * len(tasks) if outputs is None else outputs
    equations = []
    for k, (task, y) in enumerate(zip(tasks, ys, strict=True)):
        value = _residual(problem, task, y, points[k], predicted[k], measured[k])
        jacobian = -_weight(problem, task) * problem.centred(derivatives[k, : len(task.slots)])
        prior = _priors(problem, task).slopes(points[k])[:, task.slots] * (task.high - task.low)
        columns = jacobian.reshape(len(task.slots), derivatives[k, 0].size), prior.T, np.diag(task.regularisation)
        rows = np.concatenate(columns, axis=1)
        with np.errstate(over="ignore", invalid="ignore"):
            equations.append(
                ((float(value @ value), rows @ value, rows @ rows.T), _misfit_by_series(problem, task, value))
            )
    return equations
