"""Levenberg-Marquardt within bounds, many fits at once: derivatives in one batched program, the small algebra here.

Bounds limit each step; they are no map onto the whole line: on such a map a
bound is infinitely far away and a narrow minimum bends, and a fit that takes 20 steps here took 150 there
(`studies/coverage`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from dataclasses import fields as fields_of
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import ResultCache
from smajax.fit.predicted import chunks, predicted_and_derivatives
from smajax.fit.problem import FitTask, Problem

MAX_STEPS = 120
TOLERANCE = 1e-8  # of the cost: what the last step may still lower it by, and predict; scipy's too
MIN_WIDTH = 1e-12  # of the range between the bounds
INITIAL_DAMPING = 1e-1  # share of the squared columns
MAX_DAMPING = 1e10  # at which no step lowers the cost
FRACTION_TO_BOUND = 0.7  # a step goes at most this share of the way to a bound
NEAR_BOUND = 1e-3  # of the range: from here on the bound itself may be reached
MIN_SCALE = 1e-14  # of the largest squared column, for a parameter on which nothing depends
TINY = 1e-300  # no division by zero


@dataclass(frozen=True)
class Fit:
    """One fit ended."""

    values: np.ndarray  # every parameter, shape (P,)
    cost: float  # sum of squared residuals, misfit over noise
    converged: bool
    reason: str
    steps: int


@dataclass(frozen=True)
class FitSettings:
    """How fits are run. `stage`: the name under which `progress` reports them."""

    max_steps: int = MAX_STEPS
    tolerance: float = TOLERANCE
    cache: ResultCache = field(default_factory=ResultCache)
    progress: Progress = quiet
    stage: str = "fitting"


@dataclass
class LMState:
    """State of one fit of F free parameters; `y` is in shares of the range between the bounds."""

    y: np.ndarray  # (F,)
    cost: float  # r^T r
    gradient: np.ndarray  # J^T r
    hessian: np.ndarray  # J^T J
    scale: np.ndarray  # largest squared columns so far (Marquardt's scaling)
    damping: float = INITIAL_DAMPING
    growth: float = 2.0
    steps: int = 0
    reason: str = ""


NormalEquations = tuple[float, np.ndarray, np.ndarray]  # r^T r, J^T r, J^T J of one fit, by shares of its range


def _normal_equations(
    problem: Problem, tasks: Sequence[FitTask], ys: Sequence[np.ndarray], outputs: np.ndarray | None
) -> list[NormalEquations]:
    """Of every task at its y. Directions of all tasks go side by side, whatever each of them frees."""
    points = np.stack([task.values_at(y) for task, y in zip(tasks, ys, strict=True)])
    most = max(1, *(len(task.slots) for task in tasks))
    tangents = np.zeros((len(tasks), most, points.shape[1]))
    for rows, task in zip(tangents, tasks, strict=True):
        rows[np.arange(len(task.slots)), task.slots] = task.high - task.low
    predicted, derivatives = predicted_and_derivatives(problem, points, tangents)
    equations = []
    for k, (task, y) in enumerate(zip(tasks, ys, strict=True)):
        measured = problem.measured if outputs is None else outputs[k]
        weight = np.repeat(np.sqrt(task.weights), len(problem.batch.outputs))[:, None] / np.asarray(problem.noise)
        residual = weight * problem.centred(measured - predicted[k])
        jacobian = -weight * problem.centred(derivatives[k, : len(task.slots)])
        drift = task.regularisation * (y - task.initial_guess)
        value = np.concatenate([residual.ravel(), problem.priors.rows(points[k]), drift])
        prior = problem.priors.slopes(points[k])[:, task.slots] * (task.high - task.low)
        columns = jacobian.reshape(len(task.slots), residual.size), prior.T, np.diag(task.regularisation)
        rows = np.concatenate(columns, axis=1)
        with np.errstate(over="ignore", invalid="ignore"):  # a step to where a load jumps: it will be rejected
            equations.append((float(value @ value), rows @ value, rows @ rows.T))
    return equations


def _step(state: LMState) -> np.ndarray:
    """The damped step within its bounds, solved exactly: least squares by the Cholesky factor of the damped equations."""
    least = MIN_SCALE * max(float(state.scale.max()), TINY)
    damped = state.hessian + state.damping * np.diag(np.maximum(state.scale, least))
    # Part of the way to a bound at a time: a long first step must not end in a corner that no later one leaves.
    y, part = state.y, 1.0 - FRACTION_TO_BOUND
    low = np.where(y < NEAR_BOUND, 0.0, part * y) - y
    high = np.where(y > 1.0 - NEAR_BOUND, 1.0, 1.0 - part * (1.0 - y)) - y
    try:
        factor = np.linalg.cholesky(damped)
        newton = -np.linalg.solve(damped, state.gradient)
    except np.linalg.LinAlgError:
        return np.zeros_like(y)  # singular to rounding: more damping makes it positive definite
    if np.all((low <= newton) & (newton <= high)):
        return newton
    # scipy refuses bounds without a point between them.
    wide = np.where(high > low, high, low + MIN_WIDTH)
    with np.errstate(divide="ignore", invalid="ignore"):  # scipy's way along a bound may be of no length
        bounded = lsq_linear(factor.T, -np.linalg.solve(factor, state.gradient), (low, wide), method="bvls").x
    return np.clip(bounded, low, high) if np.isfinite(bounded).all() else np.zeros_like(y)


def _update(state: LMState, step: np.ndarray, there: NormalEquations, tolerance: float = TOLERANCE) -> None:
    """Accept or reject the step by the normal equations at its end (Nielsen 1999), and say when it was the last."""
    cost, gradient, hessian = there
    predicted = -(2.0 * state.gradient @ step + step @ state.hessian @ step)
    actual = state.cost - cost if _is_finite(there) else -np.inf
    state.steps += 1
    small = 0.0 < predicted < tolerance * state.cost
    if actual > 0.0:
        ratio = actual / max(predicted, TINY)
        state.y, state.cost = np.clip(state.y + step, 0.0, 1.0), cost
        state.gradient, state.hessian = gradient, hessian
        state.scale = np.maximum(state.scale, np.diag(hessian))
        state.damping *= max(0.1, 1.0 - (2.0 * min(ratio, 1.0) - 1.0) ** 3)
        state.growth = 2.0
        if small and actual < tolerance * state.cost:
            state.reason = f"it has converged, no step lowers the cost by more than {tolerance:.0e} of it"
    else:
        state.damping *= state.growth
        state.growth *= 2.0
        if small or state.damping > MAX_DAMPING:
            state.reason = "it has converged, no step lowers the cost any more"


def _is_finite(equations: NormalEquations) -> bool:
    return all(bool(np.isfinite(part).all()) for part in equations)


def _initial_state(task: FitTask, equations: NormalEquations) -> LMState:
    cost, gradient, hessian = equations
    finite = _is_finite(equations)
    state = LMState(task.initial_guess, cost if finite else np.inf, gradient, hessian, np.diag(hessian).copy())
    if not finite:
        state.reason = "the model gives no number at the start"
    elif not len(task.slots):
        state.reason = "no parameter is free"
    return state


def _packed(states: Sequence[LMState], rounds: int) -> dict[str, np.ndarray]:
    """All fits' states as arrays; those of fits with fewer free parameters are padded with zeros."""
    most = max((len(state.y) for state in states), default=0)

    def padded(value: np.ndarray | float | str) -> np.ndarray:
        array = np.asarray(value)
        return np.pad(array, [(0, most - size) for size in array.shape]) if array.ndim else array

    fields = {
        entry.name: np.asarray([padded(getattr(state, entry.name)) for state in states]) for entry in fields_of(LMState)
    }
    return {**fields, "rounds": np.asarray(rounds)}


def _unpacked(record: Mapping[str, np.ndarray], tasks: Sequence[FitTask]) -> list[LMState]:
    def cut(value: np.ndarray, size: int) -> Any:
        return value[(slice(size),) * value.ndim] if value.ndim else value.item()

    rows = zip(*(record[entry.name] for entry in fields_of(LMState)), strict=True)
    return [
        LMState(*(cut(np.asarray(part), len(task.slots)) for part in row))
        for task, row in zip(tasks, rows, strict=True)
    ]


def levenberg_marquardt(
    problem: Problem,
    tasks: Sequence[FitTask],
    settings: FitSettings | None = None,
    *,
    outputs: np.ndarray | None = None,
) -> list[Fit]:
    """Fit every task from its own values.

    A fit ends when a step lowers its cost by less than the tolerance and predicted no more. States are cached as the
    rounds go: the same call resumes an interrupted one, with the same result. `outputs`, (tasks, series, N): measured
    outputs of each task, as in repeated experiments.
    """
    settings = settings or FitSettings()
    cache, progress = settings.cache, settings.progress
    directions = max([len(task.slots) for task in tasks], default=1)

    def evaluate(indices: Sequence[int], ys: Sequence[np.ndarray]) -> list[NormalEquations]:
        equations: list[NormalEquations] = []
        for cut in chunks(problem, len(indices), directions):
            part = list(indices[cut])
            measured = None if outputs is None else outputs[np.asarray(part)]
            equations += _normal_equations(problem, [tasks[k] for k in part], ys[cut], measured)
        return equations

    everyone = range(len(tasks))
    settled = settings.max_steps, settings.tolerance
    key = cache.key((problem, list(tasks)), "levenberg_marquardt", outputs if outputs is not None else "", *settled)
    cached = cache.load(key)
    if cached is not None:
        states, begin = _unpacked(cached, tasks), int(cached["rounds"])
    else:
        first = evaluate(everyone, [task.initial_guess for task in tasks])
        states, begin = [_initial_state(task, at) for task, at in zip(tasks, first, strict=True)], 0
    for number in range(begin, settings.max_steps):
        cache.save(key, _packed(states, number), last=False)
        going = [k for k in everyone if not states[k].reason]
        share = max(1.0 - len(going) / max(len(tasks), 1), number / settings.max_steps)
        progress(Stage(settings.stage, share))
        if not going:
            break
        steps = [_step(states[k]) for k in going]
        tried = [np.clip(states[k].y + step, 0.0, 1.0) for k, step in zip(going, steps, strict=True)]
        for k, step, there in zip(going, steps, evaluate(going, tried), strict=True):
            _update(states[k], step, there, settings.tolerance)
    cache.save(key, _packed(states, settings.max_steps))
    progress(Stage(settings.stage, 1.0))
    return [_ended(task, state, settings.max_steps) for task, state in zip(tasks, states, strict=True)]


def _ended(task: FitTask, state: LMState, max_steps: int) -> Fit:
    converged = bool(state.reason) and bool(np.isfinite(state.cost))
    reason = state.reason or f"{max_steps} steps were not enough"
    return Fit(task.values_at(state.y), state.cost, converged, reason, state.steps)
