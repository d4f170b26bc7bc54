"""Levenberg-Marquardt within bounds, as a descent and a search of optimistix (Rader, Lyons and Kidger 2024).

optimistix divides a least-squares method into a descent (which step, for a step size) and a search (accept or reject a
step, and the next step size). Its own `DampedNewtonDescent` knows no bounds. `BoundedDampedNewtonDescent` minimises the
same damped quadratic model within the bounds, exactly; `GainRatioSearch` is the trust region of Nielsen (1999). Both
take normal equations (`FunctionInfo.EvalGradHessian`, f = r^T r / 2) as well as residual and Jacobian
(`FunctionInfo.ResidualJac`): they serve `optimistix.least_squares` within JAX, and `levenberg_marquardt`, which calls
them step by step because its residuals are machine code outside JAX.

Bounds on the step, and not a map of the bounded interval onto the whole line: on such a map a bound is infinitely far
away, and correlated parameters change at the same cost along a curve instead of a line. A fit that takes 20 steps here took
150 there (`studies/coverage`).
"""

from __future__ import annotations

from typing import Any, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

# Share of the squared columns: nearly the whole step of Gauss and Newton, for a rejected one costs little.
INITIAL_DAMPING = 1e-5
FRACTION_TO_BOUND = 0.7  # a step goes at most this share of the way to a bound
NEAR_BOUND = 1e-3  # of the range: from here on the bound itself may be reached
MIN_SCALE = 1e-14  # of the largest squared column, for a parameter on which nothing depends
TINY = 1e-300  # no division by zero
MAX_ROUNDS = 200  # of the active-set method; each fixes or frees one variable, and few are needed
ROUNDING = 1e-13  # of the terms of a gradient: a smaller one is zero

# `FunctionInfo.EvalGradHessian` or `FunctionInfo.ResidualJac`, which are no types to a checker: see equinox in pyproject.
Information: TypeAlias = Any


def _gradient_and_hessian(information: Information) -> tuple[Float[Array, " y"], Float[Array, "y y"]]:
    """J^T r and J^T J."""
    if isinstance(information, optx.FunctionInfo.EvalGradHessian):
        return information.grad, information.hessian.as_matrix()
    jacobian = information.jac.as_matrix()
    return jacobian.T @ information.residual, jacobian.T @ jacobian


def bounded_quadratic_minimum(
    matrix: Float[Array, "y y"], gradient: Float[Array, " y"], low: Float[Array, " y"], high: Float[Array, " y"]
) -> Float[Array, " y"]:
    r"""Minimum over low <= s <= high of $g^T s + s^T A s / 2$, A positive definite; zeros where A is not, to rounding.

    Active-set method (Stark and Parker 1995, bounded-variable least squares): the free variables take the Newton step, or the
    part of it up to the first bound, where that variable is fixed; at a full step the one whose gradient points most into
    the range is freed. Exact once the active set is found, here from that of the clipped unbounded minimum.
    """

    def newton_step(free: Bool[Array, " y"], slope: Float[Array, " y"]) -> Float[Array, " y"]:
        both = free[:, None] & free[None, :]
        factor = jax.scipy.linalg.cho_factor(jnp.where(both, matrix, jnp.eye(len(slope))))
        return -jax.scipy.linalg.cho_solve(factor, jnp.where(free, slope, 0.0))

    def improve(state: tuple[Any, ...]) -> tuple[Any, ...]:
        at, free, _, count = state
        step = newton_step(free, gradient + matrix @ at)
        bound = jnp.where(step < 0.0, low, high)
        shares = jnp.where(free & (step != 0.0), (bound - at) / jnp.where(step == 0.0, 1.0, step), jnp.inf)
        first = jnp.argmin(shares)
        full = shares[first] >= 1.0
        partial = jnp.clip(at + shares[first] * step, low, high).at[first].set(bound[first])
        following = jnp.where(full, jnp.clip(at + step, low, high), partial)
        slope = gradient + matrix @ following
        rounding = ROUNDING * (jnp.abs(gradient) + jnp.abs(matrix) @ jnp.abs(following))
        inwards = jnp.where(following <= low, -slope, slope) - rounding
        # A variable without a width between its bounds stays.
        inwards = jnp.where(free | (high <= low), -jnp.inf, inwards)
        best = jnp.argmax(inwards)
        ended = full & ~(inwards[best] > 0.0)
        freed = jnp.where(full, free.at[best].set(free[best] | (inwards[best] > 0.0)), free.at[first].set(False))
        return following, freed, ended, count + 1

    newton = newton_step(jnp.ones(gradient.shape, bool), gradient)
    inside = jnp.all((low <= newton) & (newton <= high))
    finite = jnp.all(jnp.isfinite(newton))
    start = jnp.clip(jnp.where(finite, newton, 0.0), low, high)
    state = start, (start > low) & (start < high), inside | ~finite, 0
    end = jax.lax.while_loop(lambda state: ~state[2] & (state[3] < MAX_ROUNDS), improve, state)[0]
    return jnp.where(jnp.all(jnp.isfinite(end)), end, 0.0)


class DescentState(eqx.Module):
    """The quadratic model at the point accepted last."""

    y: Float[Array, " y"]
    gradient: Float[Array, " y"]
    hessian: Float[Array, "y y"]
    scale: Float[Array, " y"]  # largest squared column of the Jacobian so far (Marquardt's scaling)


class BoundedDampedNewtonDescent(optx.AbstractDescent):
    r"""Minimum within bounds of the model $g^T s + s^T (H + \mathrm{diag}(scale)/\text{step size}) s / 2$."""

    lower: float = 0.0
    upper: float = 1.0

    def init(self, y: Float[Array, " y"], f_info_struct: Information) -> DescentState:
        zeros = jnp.zeros_like(y)
        return DescentState(y, zeros, jnp.zeros((*y.shape, *y.shape)), zeros)

    def query(self, y: Float[Array, " y"], f_info: Information, state: DescentState) -> DescentState:
        gradient, hessian = _gradient_and_hessian(f_info)
        return DescentState(y, gradient, hessian, jnp.maximum(state.scale, jnp.diag(hessian)))

    def step(self, step_size: Float[Array, ""], state: DescentState) -> tuple[Float[Array, " y"], optx.RESULTS]:
        least = MIN_SCALE * jnp.maximum(jnp.max(state.scale, initial=0.0), TINY)
        damped = state.hessian + jnp.diag(jnp.maximum(state.scale, least)) / step_size
        # Part of the way to a bound at a time: a long first step must not end in a corner that no later one leaves.
        below, above = state.y - self.lower, self.upper - state.y
        near = NEAR_BOUND * (self.upper - self.lower)
        low = -jnp.where(below < near, below, FRACTION_TO_BOUND * below)
        high = jnp.where(above < near, above, FRACTION_TO_BOUND * above)
        return bounded_quadratic_minimum(damped, state.gradient, low, high), optx.RESULTS.successful


class SearchState(eqx.Module):
    """Damping, and by how much f fell in the last step and would have fallen by the model."""

    damping: Float[Array, ""]
    growth: Float[Array, ""]
    predicted: Float[Array, ""]
    actual: Float[Array, ""]  # -inf where f or its derivatives are not finite


class GainRatioSearch(optx.AbstractSearch):
    """Damping by the ratio of actual to predicted reduction (Nielsen 1999); any step that lowers f is accepted.

    A step size is one over the damping, as in `optimistix.DampedNewtonDescent`.
    """

    initial_damping: float = INITIAL_DAMPING

    def init(self, y: Float[Array, " y"], f_info_struct: Information) -> SearchState:
        zero = jnp.zeros(())
        return SearchState(zero + self.initial_damping, zero + 2.0, zero, zero)

    def step(
        self,
        first_step: Bool[Array, ""],
        y: Float[Array, " y"],
        y_eval: Float[Array, " y"],
        f_info: Information,
        f_eval_info: Information,
        state: SearchState,
    ) -> tuple[Float[Array, ""], Bool[Array, ""], optx.RESULTS, SearchState]:
        step = y_eval - y
        gradient, hessian = _gradient_and_hessian(f_info)
        there = f_eval_info.as_min(), *_gradient_and_hessian(f_eval_info)
        finite = jnp.all(jnp.stack([jnp.all(jnp.isfinite(part)) for part in there]))
        predicted = -(gradient @ step + 0.5 * step @ hessian @ step)
        actual = jnp.where(finite, f_info.as_min() - there[0], -jnp.inf)
        better = actual > 0.0
        ratio = jnp.minimum(actual / jnp.maximum(predicted, TINY), 1.0)
        factor = jnp.where(better, jnp.maximum(0.1, 1.0 - (2.0 * ratio - 1.0) ** 3), state.growth)
        damping = jnp.where(first_step, state.damping, state.damping * factor)
        growth = jnp.where(better | first_step, 2.0, 2.0 * state.growth)
        result = SearchState(damping, growth, predicted, actual)
        return 1.0 / damping, better | first_step, optx.RESULTS.successful, result
