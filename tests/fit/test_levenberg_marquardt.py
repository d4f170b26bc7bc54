"""Least squares within bounds: the same end as scipy's, wherever the optimum lies, and none where there is no number."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from scipy.optimize import least_squares, lsq_linear

from smajax.attribution.program_fits import comparison_settings
from smajax.fit.bounded_descent import (
    BoundedDampedNewtonDescent,
    DescentState,
    GainRatioSearch,
    bounded_quadratic_minimum,
)
from smajax.fit.directions import directions
from smajax.fit.levenberg_marquardt import (
    GOAL_STEPS,
    MAX_DAMPING,
    MAX_STEPS,
    TOLERANCE,
    FitSettings,
    LMState,
    Status,
    _advanced,
    _best_of_each,
    _initial_state,
    _without_exceeding,
    levenberg_marquardt,
)
from smajax.fit.normal_equations import NormalEquations
from smajax.fit.problem import FitTask
from smajax.fit.robust import robust_variance
from smajax.fit.sensitivity import Sensitivity
from smajax.report.identifiability_words import weak_combinations
from tests.helpers.hot_weight import hot_weight
from tests.helpers.often import often

TOLERANCES = TOLERANCE, 0.0


class _BoundedLevenbergMarquardt(optx.AbstractGaussNewton):
    """Descent and search of the package in optimistix's own loop."""

    rtol: float = 1e-10
    atol: float = 1e-10
    norm: Any = staticmethod(optx.max_norm)
    descent: Any = BoundedDampedNewtonDescent()
    search: Any = GainRatioSearch()
    verbose: Any = optx.LevenbergMarquardt(1e-3, 1e-3).verbose  # off

    def terminate(
        self, fn: Any, y: Any, args: Any, options: Any, state: Any, tags: Any
    ) -> tuple[jax.Array, optx.RESULTS]:
        ended, result = super().terminate(fn, y, args, options, state, tags)
        return ended | (state.search_state.damping > MAX_DAMPING), result


def _task(start: np.ndarray) -> FitTask:
    """Every parameter is free, between 0 and 1."""
    size = len(start)
    return FitTask(np.arange(size), np.zeros(size), np.ones(size), start, np.ones(1), np.zeros(size))


def _fitted(columns: np.ndarray, target: np.ndarray, start: np.ndarray) -> LMState:
    state = _initial_state(_task(start), 8)
    while state.status == Status.RUNNING and state.steps < MAX_STEPS:
        residual = columns @ np.asarray(state.y_eval)[: len(start)] - target
        equations = float(residual @ residual), columns.T @ residual, columns.T @ columns
        state = _advanced(state, equations, TOLERANCES)
    return state


@pytest.mark.parametrize("size", often([2, 3, 6], [3]))
def test_linear_problems_end_where_scipys_do(size: int) -> None:
    """Optima inside, on edges and in corners of the bounds."""
    rng = np.random.default_rng(size)
    for _ in range(100):
        columns = rng.standard_normal((50, size))
        truth = rng.uniform(-0.3, 1.3, size)
        target = columns @ truth + 0.1 * rng.standard_normal(50)
        state = _fitted(columns, target, rng.uniform(size=size))
        least = 2.0 * lsq_linear(columns, target, (0.0, 1.0), method="bvls").cost
        assert state.status in (Status.CONVERGED, Status.NO_DESCENT)
        assert 2.0 * float(state.f) == pytest.approx(least, rel=1e-4)


@pytest.mark.parametrize("size", often([1, 4, 20], [4]))
def test_the_step_within_bounds_is_scipys(size: int) -> None:
    """Exactly, in problems of a condition up to 1e6 in the Jacobian."""
    rng = np.random.default_rng(size)
    solve = jax.jit(bounded_quadratic_minimum)
    for _ in range(100):
        columns = np.linalg.qr(rng.standard_normal((60, size)))[0] * 10.0 ** rng.uniform(-3.0, 3.0, size)
        columns = columns @ np.linalg.qr(rng.standard_normal((size, size)))[0]
        target = rng.standard_normal(60) * np.linalg.norm(columns)
        low, high = -rng.uniform(0.0, 1.0, size), rng.uniform(0.0, 1.0, size)
        exact = lsq_linear(columns, target, (low, high), method="bvls", tol=1e-15, max_iter=1000)
        step = np.asarray(solve(columns.T @ columns, -columns.T @ target, low, high))
        assert ((low <= step) & (step <= high)).all()
        cost = 0.5 * float(np.sum((columns @ step - target) ** 2))
        assert cost <= exact.cost * (1.0 + 1e-9)


@pytest.mark.slow  # in our own loop above
def test_within_optimistixs_own_loop_the_end_is_scipys() -> None:
    """Rosenbrock's function with its optimum inside, and with the bounds before it."""

    def residual(y: jax.Array, args: float) -> jax.Array:
        return jnp.stack([10.0 * (args * y[1] - (args * y[0]) ** 2), 1.0 - args * y[0]])

    start = np.array([0.1, 0.9])
    solver = _BoundedLevenbergMarquardt()
    for scale in (2.0, 0.8):
        solution = optx.least_squares(residual, solver, jnp.asarray(start), scale, max_steps=500)
        exact = least_squares(lambda y, scale=scale: np.asarray(residual(jnp.asarray(y), scale)), start, bounds=(0, 1))
        np.testing.assert_allclose(solution.value, exact.x, atol=1e-5)


ONE = _task(np.full(1, 0.5))


def test_a_fit_ends_where_its_cost_falls_by_less_than_the_absolute_tolerance() -> None:
    state = _initial_state(ONE, 8)
    falling = [(1.0, np.ones(1)), (0.9, np.ones(1)), (0.8999, np.full(1, 1e-3))]
    ended = []
    for cost, gradient in falling:
        state = _advanced(state, (cost, gradient, np.eye(1) * 1e3), (0.0, 0.01))
        ended.append(int(state.status))
    assert ended == [Status.RUNNING, Status.RUNNING, Status.CONVERGED]


def test_fits_far_above_the_best_end_after_as_many_steps_as_allowed() -> None:
    near, far = (_advanced(_initial_state(ONE, 8), (cost, np.ones(1), np.eye(1)), TOLERANCES) for cost in (10.0, 200.0))
    allowed = FitSettings(allowed_excess=((3, 400.0), (6, 100.0)))
    for steps, expected in ((2, Status.RUNNING), (3, Status.RUNNING), (6, Status.EXCEEDED)):
        states = _without_exceeding([ONE, ONE], [near, far], steps, allowed)
        assert [int(state.status) for state in states] == [Status.RUNNING, expected]
    elsewhere = dataclasses.replace(allowed, least_cost=9.0)  # of fits in another program
    states = _without_exceeding([ONE], [far], 6, elsewhere)
    assert [int(state.status) for state in states] == [Status.EXCEEDED]


def test_a_fit_ends_that_promises_to_stay_far_above_the_best() -> None:
    """By the least value of its quadratic model: cost 200 with a column that takes off 10, or 190, of it."""
    best = _advanced(_initial_state(ONE, 8), (10.0, np.zeros(1), np.eye(1)), TOLERANCES)
    settings = FitSettings(promised_excess=(4, 50.0))
    for decrease, steps, expected in (
        (10.0, 4, Status.EXCEEDED),
        (10.0, 3, Status.RUNNING),
        (190.0, 4, Status.RUNNING),
    ):
        # The minimum of f = r^T r / 2 lies 0.1 away, within the bounds, and is lower by decrease / 2.
        gradient, hessian = np.array([decrease / 0.1]), np.array([[decrease / 0.1**2]])
        far = _advanced(_initial_state(ONE, 8), (200.0, gradient, hessian), TOLERANCES)
        assert [int(one.status) for one in _without_exceeding([ONE, ONE], [best, far], steps, settings)] == [
            Status.RUNNING,
            expected,
        ]


def test_a_fit_ends_that_promises_to_stay_above_its_goal() -> None:
    """Cost 200 that falls by 60 to the least value of its quadratic model: to a goal of 85 it may come by twice that, to 70 not."""
    gradient, hessian = np.array([600.0]), np.array([[6000.0]])
    state = _advanced(_initial_state(ONE, 8), (200.0, gradient, hessian), TOLERANCES)
    for goal, steps, expected in (
        (85.0, GOAL_STEPS, Status.RUNNING),
        (70.0, GOAL_STEPS, Status.EXCEEDED),
        (70.0, GOAL_STEPS - 1, Status.RUNNING),
        (250.0, GOAL_STEPS, Status.RUNNING),  # it is there
    ):
        (one,) = _without_exceeding([ONE._replace(goal=goal)], [state], steps, FitSettings())
        assert one.status == expected


def test_of_fits_that_free_the_same_the_best_alone_goes_on() -> None:
    one, other = _task(np.full(1, 0.5)), _task(np.full(2, 0.5))
    tasks, costs = [one, one, other], [3.0, 2.0, 9.0]
    states = [
        _advanced(_initial_state(task, 8), (cost, np.ones(len(task.slots)), np.eye(len(task.slots))), TOLERANCES)
        for task, cost in zip(tasks, costs, strict=True)
    ]
    left = [int(state.status) for state in _best_of_each(tasks, states)]
    assert left == [Status.EXCEEDED, Status.RUNNING, Status.RUNNING]


def test_steps_that_are_rejected_are_no_rounds_whether_costs_or_derivatives_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Fits that end early are the same ones: far from the optimum a first step is shortened several times."""
    joint = hot_weight({}).joint
    effects = ("latent_heat", "rising_convection", "sensor_gain")
    problem, _ = joint.restricted(effects)
    problem = problem.with_noise(1e-3)
    names, start = joint.free(effects), problem.start_values()
    (best,) = levenberg_marquardt(problem, [problem.task(names, joint.bounds, start)])
    settings = dataclasses.replace(comparison_settings(FitSettings(), "fitting"), least_cost=best.cost)
    places = [problem.names.index(name) for name in names]
    low, high = np.transpose([joint.bounds[name] for name in names])
    fits = []
    for few in (0, 8):
        monkeypatch.setattr("smajax.fit.levenberg_marquardt.FEW_RUNS", few)
        rng, found = np.random.default_rng(0), []
        for _ in range(8):
            values = np.array(start)
            off = rng.uniform(-0.2, 0.2, len(names)) * (high - low)
            values[places] = np.clip(best.values[places] + off, low, high)
            found += levenberg_marquardt(problem, [problem.task(names, joint.bounds, values)], settings)
        fits.append([(fit.status, fit.steps, round(fit.cost, 3)) for fit in found])
    assert fits[0] == fits[1]
    assert {Status.EXCEEDED, Status.CONVERGED} <= {status for status, *_ in fits[0]}


def test_a_step_to_a_jacobian_that_is_not_finite_is_rejected() -> None:
    state = _advanced(_initial_state(_task(np.full(2, 0.5)), 8), (1.0, np.ones(2), np.eye(2)), TOLERANCES)
    assert not np.array_equal(state.y_eval, state.y)
    after = _advanced(state, (0.5, np.array([np.nan, 1.0]), np.eye(2)), TOLERANCES)
    np.testing.assert_array_equal(after.y, state.y)
    assert after.status == Status.RUNNING
    lost: NormalEquations = (np.nan, np.ones(2), np.eye(2))
    assert _advanced(_initial_state(_task(np.full(2, 0.5)), 8), lost, TOLERANCES).status == Status.NOT_FINITE


def test_equations_that_are_singular_to_rounding_are_no_error() -> None:
    """Two parameters with one trace and no damping: a Cholesky factor may exist where a solution does not."""
    random = np.random.default_rng(0)
    step = jax.jit(BoundedDampedNewtonDescent().step)
    for _ in range(500):
        row = random.normal(size=2) * 10.0 ** random.integers(-3, 3, size=2)
        state = DescentState(*(jnp.asarray(part) for part in (np.full(2, 0.5), row, np.outer(row, row), row**2)))
        assert np.isfinite(step(jnp.asarray(np.inf), state)[0]).all()


def test_two_parameters_that_act_by_their_product_are_not_without_influence() -> None:
    column = np.random.default_rng(0).standard_normal(300)
    at = Sensitivity(("a", "b"), np.zeros((1, 300)), np.stack([column, column], axis=1)[None], np.ones((1, 300)))
    sentences = weak_combinations(directions(at, ("a", "b"), {"a": 1.0, "b": 1.0}, 1.0))
    assert len(sentences) == 2 or "none of them is identifiable by itself" in sentences[0]
    assert "none of them is identifiable by itself" in sentences[0]
    assert not any("Nothing" in sentence for sentence in sentences)


def test_the_variance_of_a_robust_mean_is_that_of_repeated_ones() -> None:
    """Huber's mean of samples of which a tenth is far off: its variance over repetitions."""
    rng = np.random.default_rng(3)
    means, predicted = [], []
    for _ in range(400):
        sample = np.where(rng.uniform(size=300) < 0.1, 10.0, 1.0) * rng.standard_normal(300)
        centre = float(np.median(sample))
        for _ in range(30):
            spread = 1.4826 * np.median(np.abs(sample - centre))
            weight = 1.0 / np.maximum(np.abs(sample - centre) / (1.345 * spread), 1.0)
            centre = float((weight * sample).sum() / weight.sum())
        means.append(centre)
        predicted.append(robust_variance(sample - centre) / 300)
    assert np.mean(predicted) == pytest.approx(np.var(means), rel=0.2)
