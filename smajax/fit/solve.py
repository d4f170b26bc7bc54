"""Batches of least-squares fits: optimistix's Levenberg-Marquardt over lanes, in short legs so that progress shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from smajax.fit.problem import Lane, Problem, free_of, residual, values_of
from smajax.fit.progress import Progress, quiet
from smajax.fit.shown import shown_at

STEPS_PER_LEG = 10
# The residual's square at the start of a leg. The solver damps with the identity and starts at one: with this cost a
# parameter that matters is hardly damped and one that does not is held. Left in units of the noise the cost is 1e6,
# the damping next to nothing, and a fit far from its optimum rejects every step.
START_COST = 1e3
LANES = 4  # lanes solved at once: larger batches cost as much per lane on a CPU, and every size compiles anew


@dataclass(frozen=True)
class Solution:
    """One lane solved."""

    values: np.ndarray  # every parameter, and the dummy: shape (P + 1,)
    cost: float  # sum of squared residuals (misfit over noise) of the weighted runs
    converged: bool
    legs: int


def stacked(lanes: Sequence[Lane]) -> Lane:
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *lanes)


@eqx.filter_jit
def _leg(free: jax.Array, lanes: Lane, problem: Problem) -> tuple[jax.Array, jax.Array, jax.Array]:
    solver: Any = optx.LevenbergMarquardt(rtol=1e-5, atol=1e-5)

    def one(free: jax.Array, lane: Lane) -> tuple[jax.Array, jax.Array, jax.Array]:
        solution = optx.least_squares(
            residual, solver, free, args=(lane, problem), has_aux=True, max_steps=STEPS_PER_LEG, throw=False
        )
        # The auxiliary output is the cost at the accepted point: without it the model would be compiled once more.
        return solution.value, solution.aux, solution.result == optx.RESULTS.successful

    return eqx.filter_vmap(one)(free, lanes)


@eqx.filter_jit
def _values(free: jax.Array, lanes: Lane) -> jax.Array:
    return jax.vmap(values_of)(free, lanes)


def solve(
    problem: Problem,
    lanes: Sequence[Lane],
    *,
    legs: int = 6,
    enough: float = 1e-3,
    start_cost: float = START_COST,
    progress: Progress = quiet,
    what: str = "fitting",
) -> list[Solution]:
    """Solve every lane; a lane stops when the solver says so or a leg lowers its cost by less than `enough` of it.

    Lanes go `LANES` at a time (the last batch is filled up by repeating its first lane), so one compilation serves
    any number of them.
    """
    solutions: list[Solution] = []
    batches = [lanes[start : start + LANES] for start in range(0, len(lanes), LANES)]
    for number, some in enumerate(batches):
        batch = stacked([*some, *[some[0]] * (LANES - len(some))])
        free = jax.vmap(free_of)(batch)
        cost = _costs(problem, np.asarray(_values(free, batch)), np.asarray(batch.weights))
        done = np.zeros(LANES, bool)
        leg = 0
        while leg < legs and not done[: len(some)].all():
            scale = np.sqrt(np.maximum(cost, 1e-12) / start_cost)
            new, new_cost, converged = _leg(free, batch._replace(scale=jnp.asarray(scale)), problem)
            new_cost = np.asarray(new_cost) * scale**2
            better = (new_cost < cost) & ~done  # a lane's result must not depend on what shares its batch
            free = jnp.where(jnp.asarray(better)[:, None], new, free)
            done, cost = (
                done | np.asarray(converged) | (cost - new_cost < enough * cost),
                np.where(better, new_cost, cost),
            )
            leg += 1
            progress(what, (number + leg / legs) / len(batches))
        values = np.asarray(_values(free, batch))
        solutions += [Solution(values[lane], float(cost[lane]), bool(done[lane]), leg) for lane in range(len(some))]
    progress(what, 1.0)
    return solutions


@eqx.filter_jit
def _misfits(problem: Problem, shown: jax.Array) -> jax.Array:
    return jax.vmap(problem.misfit_of)(shown)


def misfits(problem: Problem, points: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Misfit (SI) of every series at every point, shape (points, series, N)."""
    return np.asarray(_misfits(problem, jnp.asarray(shown_at(problem, points))))


def _costs(problem: Problem, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    squares = (misfits(problem, points) / np.asarray(problem.noise)) ** 2
    by_series = np.repeat(weights, len(problem.batch.outputs), axis=1)
    return np.nan_to_num((squares.sum(axis=2) * by_series).sum(axis=1), nan=1e30, posinf=1e30)
