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

Unless the step before kept what it promised, or the derivatives of all fits take few runs, a round first asks what the step's cost is: one run, where derivatives take one for every two or four free parameters. It
shortens the step until the cost is lower. So a fit may begin with nearly the whole step of Gauss and Newton. On 27 fits of nine problems (bench, demo, a dead weight with friction) a cost within 1 of
the least took half of the runs that it took with derivatives at every step and a first damping of 0.1, and the base models of 36 benches ended at
the same cost from either damping. Secants in the place of derivatives (Broyden 1965), and of several dampings the best, took more.

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
from smajax.fit.normal_equations import NormalEquations, costs, normal_equations
from smajax.fit.outputs_of_runs import chunks, runs_of_derivatives
from smajax.fit.problem import FitTask, Problem

MAX_STEPS = 120
TOLERANCE = 1e-8  # of the cost: what the last step may still lower it by, and predict; scipy's too
MAX_DAMPING = 1e10  # at which no step lowers the cost
GOAL_STEPS = 4  # after which a fit has to promise to come to its goal
TWICE = 2.0  # the model's decrease: of a fit that is far from its optimum it says too little
PADDING = 16  # free parameters are padded to a multiple of this: one compiled program serves fits of several sizes
KEPT = 0.75  # share of the promised decrease, from which on the next step's derivatives are taken without asking for its cost
# Runs of the derivatives of all fits, up to which these take about as long as their costs alone: machine code runs so many side by side.
FEW_RUNS = 8
AT_ONCE = 4  # shorter steps that are tried at once after one was rejected: runs come in groups of so many and more
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


@dataclass
class _Fits:
    """Fits side by side, and where each of them is."""

    problem: Problem
    tasks: Sequence[FitTask]
    outputs: np.ndarray | None  # (tasks, series, N)
    tolerances: tuple[float, float]  # of `_advance`
    directions: int  # that a fit frees, at most
    states: list[LMState]
    errors: dict[int, np.ndarray] = field(default_factory=dict)  # at what they accepted last in this process

    def running(self) -> list[int]:
        return [k for k, state in enumerate(self.states) if state.status == Status.RUNNING]

    def _evaluated(
        self, part: Sequence[int], states: Sequence[LMState]
    ) -> tuple[list[FitTask], list[np.ndarray], np.ndarray | None]:
        ys = [np.asarray(state.y_eval)[: len(self.tasks[k].slots)] for k, state in zip(part, states, strict=True)]
        return [self.tasks[k] for k in part], ys, None if self.outputs is None else self.outputs[np.asarray(part)]

    def _rejected(self, k: int, state: LMState) -> LMState:
        """After a step that does not lower the cost: a shorter one, or the end of the fit."""
        free = len(self.tasks[k].slots)
        return _advanced(state, (np.inf, np.zeros(free), np.zeros((free, free))), self.tolerances)

    def _shorter(self, k: int, state: LMState) -> list[LMState]:
        """`state` after a rejection, and as it would be after further ones, as far as the fit goes on."""
        found = [state]
        while len(found) < AT_ONCE and found[-1].status == Status.RUNNING:
            found.append(self._rejected(k, found[-1]))
        return [one for one in found if one.status == Status.RUNNING]

    def likely_accepted(self, k: int) -> bool:
        """Whether the step before kept most of what its derivatives promised: the next one is then rarely rejected."""
        search = self.states[k].search
        return bool(self.states[k].steps > 0) and bool(search.actual > KEPT * search.predicted)

    def lowered(self, part: Sequence[int]) -> list[int]:
        """Those of these fits that come to a lower cost, at `y_eval`: whether they accept that, or end there, derivatives there decide.

        Steps are shortened until one lowers the cost, which takes a small part of the derivatives' time; after the first several are tried at once.
        """
        found, tried = [], {k: [self.states[k]] for k in part}
        while tried:
            pairs = [(k, state) for k, states in tried.items() for state in states]
            there: list[float] = []
            for cut in chunks(self.problem, len(pairs)):
                numbers, trials = zip(*pairs[cut], strict=True)
                there += costs(self.problem, *self._evaluated(numbers, trials))
            rejected = {}
            for k, states in tried.items():
                own, there = there[: len(states)], there[len(states) :]
                lower = [state for state, cost in zip(states, own, strict=True) if cost < 2.0 * float(state.f)]
                self.states[k] = lower[0] if lower else self._rejected(k, states[-1])
                if lower:
                    found.append(k)
                elif self.states[k].status == Status.RUNNING:
                    rejected[k] = self._shorter(k, self.states[k])
            tried = rejected
        return found

    def advance(self, part: Sequence[int]) -> list[int]:
        """Take derivatives of these fits at `y_eval`, and the next step from there; those that reject it and go on."""
        rejected = []
        for cut in chunks(self.problem, len(part), self.directions):
            now = list(part[cut])
            equations = normal_equations(self.problem, *self._evaluated(now, [self.states[k] for k in now]))
            for k, (at, misfit) in zip(now, equations, strict=True):
                there = self.states[k].y_eval
                self.states[k] = _advanced(self.states[k], at, self.tolerances)
                if np.array_equal(self.states[k].y, there):
                    self.errors[k] = misfit
                elif self.states[k].status == Status.RUNNING:
                    rejected.append(k)
        return rejected


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
    tolerances = settings.tolerance, 0.5 * settings.absolute_tolerance
    fits = _Fits(problem, tasks, outputs, tolerances, directions, [_initial_state(task, size) for task in tasks])
    limits = settings.allowed_excess, settings.least_cost, settings.promised_excess, settings.one_of_each
    settled = settings.max_steps, settings.tolerance, settings.absolute_tolerance, *limits
    measured = outputs if outputs is not None else ""
    key = cache.key((problem, list(tasks)), "levenberg_marquardt by cost first", measured, *settled)
    cached = cache.load(key)
    if cached is not None:
        fits.states, begin = _unpacked(cached, fits.states), int(cached["rounds"])
    else:
        fits.advance(range(len(tasks)))
        begin = 0
    for number in range(begin, settings.max_steps):
        cache.save(key, _packed(fits.states, number), last=False)
        going = fits.running()
        progress(Stage(settings.stage, max(1.0 - len(going) / max(len(tasks), 1), number / settings.max_steps)))
        if tasks and progress is not quiet:
            progress(_best(fits, settings.stage))
        if not going:
            break
        few = runs_of_derivatives(problem, len(going), directions) <= FEW_RUNS
        likely = [k for k in going if few or fits.likely_accepted(k)]
        rejected = fits.advance([*likely, *fits.lowered([k for k in going if k not in likely])])
        # A round is a step that each fit accepts: the rules that end fits early count rounds.
        fits.advance(fits.lowered([k for k in rejected if k in likely]))
        fits.states = _without_exceeding(tasks, fits.states, number + 1, settings)
        if number + 1 == settings.one_of_each:
            fits.states = _best_of_each(tasks, fits.states)
    cache.save(key, _packed(fits.states, settings.max_steps))
    progress(Stage(settings.stage, 1.0))
    return [_ended(task, state) for task, state in zip(tasks, fits.states, strict=True)]


def _best(fits: _Fits, stage: str) -> BestFit:
    """The fit of the least cost, for whoever watches."""
    problem, states, errors = fits.problem, fits.states, fits.errors
    k = int(np.argmin([float(state.f) for state in states]))
    task, table = fits.tasks[k], parameters(problem.system)
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
