"""Levenberg-Marquardt within bounds, many fits at once: derivatives in one batched program, descent and search of optimistix.

`optimistix.least_squares` traces the residual function and runs to the end. Here residuals are machine code outside JAX,
of many fits at once, and a run can be interrupted and resumed; so this driver holds the state of every fit, and each
round calls search and descent (`bounded_descent`) on the normal equations, as `optimistix.AbstractGaussNewton.step` does.

Measured against the same method in numpy with scipy's `lsq_linear` within bounds (optimistix 0.1.0, two cores, processor
time of a whole `identify` with compiled programs at hand):

| problem | evaluations | least cost, relative | algebra | identify |
|---|---|---|---|---|
| demo, latent heat | 219, before 219 | 4e-14 off | 0.34 s, before 0.25 s | 1.46 s, before 1.38 s |
| demo, complete model | 192, before 192 | 7e-15 off | 0.29 s, before 0.24 s | 1.26 s, before 1.30 s |
| bias-spring bench, 15 free | 566, before 562 | 7e-10 off | 1.56 s, before 1.20 s | 12.7 s, before 11.8 s |

Compilation takes one second of processor time for each multiple of `PADDING` free parameters, and importing optimistix 0.2 s.
"""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from smajax.core.names_of_runs import parameter_of
from smajax.core.parameters import parameters
from smajax.core.progress import BestFit, Progress, Stage, quiet
from smajax.core.result_cache import ResultCache
from smajax.fit.bounded_descent import (
    MIN_SCALE,
    TINY,
    BoundedDampedNewtonDescent,
    DescentState,
    GainRatioSearch,
    SearchState,
    bounded_quadratic_minimum,
)
from smajax.fit.outputs_of_runs import chunks, predicted_and_derivatives
from smajax.fit.problem import FitTask, Problem

MAX_STEPS = 120
TOLERANCE = 1e-8  # of the cost: what the last step may still lower it by, and predict; scipy's too
MAX_DAMPING = 1e10  # at which no step lowers the cost
GOAL_STEPS = 4  # after which a fit has to promise to come to its goal
TWICE = 2.0  # the model's decrease: of a fit that is far from its optimum it says too little
PADDING = 8  # free parameters are padded to a multiple of this: one compiled program serves fits of several sizes
DESCENT, SEARCH = BoundedDampedNewtonDescent(), GainRatioSearch()


class Status(enum.IntEnum):
    """Whether and why a fit has ended."""

    RUNNING = 0
    CONVERGED = 1
    NO_DESCENT = 2
    NOT_FINITE = 3
    NOTHING_FREE = 4
    EXCEEDED = 5


@dataclass(frozen=True)
class Fit:
    """One fit ended."""

    values: np.ndarray  # every parameter, shape (P,)
    cost: float  # sum of squared residuals, misfit over noise
    converged: bool
    status: Status
    steps: int


@dataclass(frozen=True)
class FitSettings:
    """How fits are run. `stage`: the name under which `progress` reports them.

    A fit ends where a step lowers its cost by less than `tolerance` of it, or by less than `absolute_tolerance`, and
    predicted no more. Of `allowed_excess`, (steps, cost) each: after so many steps a fit ends whose cost is above the least
    of all by more than that; `least_cost` is that of fits that have ended elsewhere. `promised_excess`, (steps, cost): the same of
    what a fit is still to come to, by twice the decrease that its derivatives promise. `one_of_each`: after so many steps one fit alone goes on, the best, of those that
    free the same parameters; 0: all do. A fit whose task has a `goal` ends after `GOAL_STEPS` where it promises to stay above that, likewise.
    """

    max_steps: int = MAX_STEPS
    tolerance: float = TOLERANCE
    absolute_tolerance: float = 0.0
    allowed_excess: tuple[tuple[int, float], ...] = ()
    least_cost: float = float("inf")
    promised_excess: tuple[int, float] | None = None
    one_of_each: int = 0
    cache: ResultCache = field(default_factory=ResultCache)
    progress: Progress = quiet
    stage: str = "fitting"


class LMState(eqx.Module):
    """State of one fit; `y` is in shares of the range between the bounds, padded with parameters without effect."""

    y: Float[Array, " y"]  # accepted last
    y_eval: Float[Array, " y"]  # to be evaluated
    f: Float[Array, ""]  # r^T r / 2 at `y`
    descent: DescentState
    search: SearchState
    steps: Int[Array, ""]
    status: Int[Array, ""]


NormalEquations = tuple[float, np.ndarray, np.ndarray]  # r^T r, J^T r, J^T J of one fit, by shares of its range


def _normal_equations(
    problem: Problem, tasks: Sequence[FitTask], ys: Sequence[np.ndarray], outputs: np.ndarray | None
) -> list[tuple[NormalEquations, np.ndarray]]:
    """Of every task at its y, with its root mean square misfit on each series, SI. Directions of all tasks go side by side, whatever each of them frees."""
    points = np.stack([task.values_at(y) for task, y in zip(tasks, ys, strict=True)])
    most = max(1, *(len(task.slots) for task in tasks))
    tangents = np.zeros((len(tasks), most, points.shape[1]))
    for rows, task in zip(tangents, tasks, strict=True):
        rows[np.arange(len(task.slots)), task.slots] = task.high - task.low
    predicted, derivatives = predicted_and_derivatives(problem, points, tangents)
    equations = []
    samples = (np.asarray(problem.batch.mask) > 0.0).sum(axis=1)
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
        with np.errstate(
            over="ignore", invalid="ignore", divide="ignore"
        ):  # a step to where a load jumps: it will be rejected
            # nan of a run without weight
            misfit = np.sqrt(np.sum((residual / weight) ** 2, axis=1) / samples) / problem.scale_of_series[:, 0]
            equations.append(((float(value @ value), rows @ value, rows @ rows.T), misfit))
    return equations


def _initial_state(task: FitTask, size: int) -> LMState:
    y = np.full(size, 0.5)
    y[: len(task.slots)] = task.initial_guess
    zero = np.zeros(size)
    descent = DescentState(y, zero, np.zeros((size, size)), zero)
    search = SearchState(*(np.asarray(value) for value in (SEARCH.initial_damping, 2.0, 0.0, 0.0)))
    status = Status.RUNNING if len(task.slots) else Status.NOTHING_FREE
    return LMState(y, y, np.asarray(np.inf), descent, search, np.asarray(-1), np.asarray(int(status)))


@jax.jit
def _advance(
    state: LMState,
    f: Float[Array, ""],
    gradient: Float[Array, " y"],
    hessian: Float[Array, "y y"],
    tolerances: tuple[float, float],
) -> LMState:
    """Accept or reject `y_eval` by the normal equations there, end the fit or take the next step.

    `tolerances`: of f, as a share of it and itself.
    """

    def information(f: Array, gradient: Array, hessian: Array) -> optx.FunctionInfo.EvalGradHessian:
        return optx.FunctionInfo.EvalGradHessian(
            f, gradient, lx.MatrixLinearOperator(hessian, lx.positive_semidefinite_tag)
        )

    first = state.steps < 0
    here, there = information(state.f, state.descent.gradient, state.descent.hessian), information(f, gradient, hessian)
    step_size, accept, _, search = SEARCH.step(first, state.y, state.y_eval, here, there, state.search)
    descent = jax.tree.map(
        lambda new, old: jnp.where(accept, new, old), DESCENT.query(state.y_eval, there, state.descent), state.descent
    )
    y, f_new = jnp.where(accept, state.y_eval, state.y), jnp.where(accept, f, state.f)
    relative, absolute = tolerances
    status = _status(first, accept, search, jnp.maximum(relative * here.f, absolute))
    finite = jnp.isfinite(f) & jnp.all(jnp.isfinite(gradient)) & jnp.all(jnp.isfinite(hessian))
    status = jnp.where(first & ~finite, Status.NOT_FINITE, jnp.where(first, state.status, status))
    step, _ = DESCENT.step(step_size, descent)
    y_eval = jnp.clip(y + step, DESCENT.lower, DESCENT.upper)
    return LMState(y, y_eval, jnp.where(first & ~finite, jnp.inf, f_new), descent, search, state.steps + 1, status)


def _status(
    first: Bool[Array, ""], accept: Bool[Array, ""], search: SearchState, least: Float[Array, ""]
) -> Int[Array, ""]:
    """A fit ends at a step that gained and predicted less than `least`, and where no step lowers the cost."""
    small = (search.predicted > 0.0) & (search.predicted < least)
    converged = small & (search.actual < least)
    ended = small | (search.damping > MAX_DAMPING)
    return jnp.where(
        accept,
        jnp.where(converged, Status.CONVERGED, Status.RUNNING),
        jnp.where(ended, Status.NO_DESCENT, Status.RUNNING),
    )


def _advanced(state: LMState, equations: NormalEquations, tolerances: tuple[float, float]) -> LMState:
    """`_advance` with equations padded to the state's size."""
    cost, gradient, hessian = equations
    size, free = state.y.size, len(gradient)
    padded, square = np.zeros(size), np.zeros((size, size))
    padded[:free], square[:free, :free] = gradient, hessian
    return jax.device_get(_advance(state, np.asarray(0.5 * cost), padded, square, tolerances))


def _packed(states: Sequence[LMState], rounds: int) -> dict[str, np.ndarray]:
    """All fits' states, leaf by leaf."""
    leaves = jax.tree.leaves(jax.tree.map(lambda *parts: np.stack(parts), *states)) if states else []
    return {**{f"leaf {k}": leaf for k, leaf in enumerate(leaves)}, "rounds": np.asarray(rounds)}


def _unpacked(record: Mapping[str, np.ndarray], states: Sequence[LMState]) -> list[LMState]:
    """States of the structure of `states` from the record."""
    leaves = [record[f"leaf {number}"] for number in range(len(record) - 1)]  # beside `rounds`
    return [
        jax.tree.unflatten(jax.tree.structure(state), [leaf[k] for leaf in leaves]) for k, state in enumerate(states)
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
    size = -(-max(directions, 1) // PADDING) * PADDING
    states = [_initial_state(task, size) for task in tasks]
    errors: dict[int, np.ndarray] = {}  # of the fits, at what they accepted last in this process

    def advance(indices: Sequence[int]) -> None:
        """Evaluate and advance these fits."""
        for cut in chunks(problem, len(indices), directions):
            part = list(indices[cut])
            measured = None if outputs is None else outputs[np.asarray(part)]
            ys = [np.asarray(states[k].y_eval)[: len(tasks[k].slots)] for k in part]
            equations = _normal_equations(problem, [tasks[k] for k in part], ys, measured)
            for k, (at, misfit) in zip(part, equations, strict=True):
                evaluated = states[k].y_eval
                states[k] = _advanced(states[k], at, (settings.tolerance, 0.5 * settings.absolute_tolerance))
                if np.array_equal(states[k].y, evaluated):
                    errors[k] = misfit

    def running() -> list[int]:
        return [k for k, state in enumerate(states) if state.status == Status.RUNNING]

    limits = settings.allowed_excess, settings.least_cost, settings.promised_excess, settings.one_of_each
    settled = settings.max_steps, settings.tolerance, settings.absolute_tolerance, *limits
    key = cache.key((problem, list(tasks)), "levenberg_marquardt", outputs if outputs is not None else "", *settled)
    cached = cache.load(key)
    if cached is not None:
        states, begin = _unpacked(cached, states), int(cached["rounds"])
    else:
        advance(range(len(tasks)))
        begin = 0
    for number in range(begin, settings.max_steps):
        cache.save(key, _packed(states, number), last=False)
        going = running()
        progress(Stage(settings.stage, max(1.0 - len(going) / max(len(tasks), 1), number / settings.max_steps)))
        if tasks and progress is not quiet:
            progress(_best(problem, tasks, states, errors, settings.stage))
        if not going:
            break
        advance(going)
        states = _without_exceeding(tasks, states, number + 1, settings)
        if number + 1 == settings.one_of_each:
            states = _best_of_each(tasks, states)
    cache.save(key, _packed(states, settings.max_steps))
    progress(Stage(settings.stage, 1.0))
    return [_ended(task, state) for task, state in zip(tasks, states, strict=True)]


def _best(
    problem: Problem,
    tasks: Sequence[FitTask],
    states: Sequence[LMState],
    errors: Mapping[int, np.ndarray],
    stage: str,
) -> BestFit:
    """The fit of the least cost, for whoever watches."""
    k = int(np.argmin([float(state.f) for state in states]))
    task, table = tasks[k], parameters(problem.system)
    values = task.values_at(np.asarray(states[k].y)[: len(task.slots)])
    names = [problem.names[slot] for slot in task.slots]
    units = {name: table[own].unit for name in names if (own := parameter_of(name)) in table}
    found = {name: float(values[slot]) for name, slot in zip(names, task.slots, strict=True)}
    return BestFit(stage, found, units, tuple(errors[k].tolist()) if k in errors else ())


def _without_exceeding(
    tasks: Sequence[FitTask], states: Sequence[LMState], steps: int, settings: FitSettings
) -> list[LMState]:
    """Fits end that after these steps are too far above the least cost or their goal, or promise to stay so."""
    excess = min((0.5 * most for after, most in settings.allowed_excess if steps >= after), default=np.inf)
    least = min(min((float(state.f) for state in states), default=np.inf), 0.5 * settings.least_cost)
    after, most = settings.promised_excess or (0, np.inf)
    ahead = least + 0.5 * most if steps >= after else np.inf

    def exceeds(task: FitTask, state: LMState) -> bool:
        f, allowed = float(state.f), min(ahead, 0.5 * task.goal if steps >= GOAL_STEPS else np.inf)
        return f > least + excess or (f > allowed and f - TWICE * float(_promised(state.descent)) > allowed)

    return [
        _ended_as_exceeded(state) if state.status == Status.RUNNING and exceeds(task, state) else state
        for task, state in zip(tasks, states, strict=True)
    ]


def _best_of_each(tasks: Sequence[FitTask], states: Sequence[LMState]) -> list[LMState]:
    """Of running fits that free the same parameters the one of the least cost goes on."""
    freed = [tuple(task.slots.tolist()) for task in tasks]
    best: dict[tuple[int, ...], float] = {}
    for one, state in zip(freed, states, strict=True):
        best[one] = min(best.get(one, np.inf), float(state.f))
    return [
        _ended_as_exceeded(state) if state.status == Status.RUNNING and float(state.f) > best[one] else state
        for one, state in zip(freed, states, strict=True)
    ]


def _ended_as_exceeded(state: LMState) -> LMState:
    return dataclasses.replace(state, status=np.asarray(int(Status.EXCEEDED)))


@jax.jit
def _promised(descent: DescentState) -> Float[Array, ""]:
    """What f falls by to the least value of the quadratic model within the bounds."""
    least = MIN_SCALE * jnp.max(jnp.diag(descent.hessian), initial=TINY)
    matrix = descent.hessian + least * jnp.eye(len(descent.y))
    low, high = DESCENT.lower - descent.y, DESCENT.upper - descent.y
    step = bounded_quadratic_minimum(matrix, descent.gradient, low, high)
    return -(descent.gradient @ step + 0.5 * step @ descent.hessian @ step)


def _ended(task: FitTask, state: LMState) -> Fit:
    status, cost = Status(int(state.status)), 2.0 * float(state.f)
    converged = status not in (Status.RUNNING, Status.EXCEEDED) and bool(np.isfinite(cost))
    return Fit(task.values_at(np.asarray(state.y)[: len(task.slots)]), cost, converged, status, int(state.steps))
