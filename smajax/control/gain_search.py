"""Gains by a search over batches of closed loops: cross-entropy, every candidate on every set point in one `vmap`.

It needs no derivative, so it serves controllers that switch. What it finds is stored with the box, the cost and the
seed in `studies/gains`.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.figures_of_merit import Merit, judged_loop
from smajax.control.reference import clock, constant
from smajax.core.parameters import set_vector
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System
from smajax.model.types import Scalar

ELITE = 0.2  # share of the candidates from which the next round is drawn
KEPT = 0.3  # share of the old spread that a round keeps


@dataclass(frozen=True)
class Found:
    """The best gains of a search, what they cost, and each set point's figures of merit (arrays of shape (targets,))."""

    gains: dict[str, float]
    cost: float
    merits: Merit
    tried: int


def regulation_cost(one: Merit, seconds: float) -> Scalar:
    """Seconds to settle (twice the run where it never does), one more a degree of overshoot, two a degree of steady error."""
    settling = jnp.where(jnp.isfinite(one.settling_time), one.settling_time, 2.0 * seconds)
    return settling + jnp.degrees(one.overshoot) + 2.0 * jnp.degrees(one.steady_error)


@eqx.filter_jit
def merits_of(
    system: System,
    controller: AbstractController,
    names: tuple[str, ...],
    gains: jax.Array,
    targets: jax.Array,
    seconds: float,
    dt: float,
    every: int,
    estimator: AbstractEstimator | None = None,
) -> Merit:
    """Figures of merit of every row of `gains` (candidates, names) at every set point: arrays (candidates, targets)."""
    time = clock(seconds, dt)

    def one(row: jax.Array, target: Scalar) -> Merit:
        tuned = set_vector(controller, names, row)
        return judged_loop(system, tuned, constant(time, target), dt, every, estimator=estimator)[0]

    return jax.vmap(lambda row: jax.vmap(lambda target: one(row, target))(targets))(gains)


def search_gains(
    system: System,
    controller: AbstractController,
    box: Mapping[str, tuple[float, float]],
    targets: Sequence[float],
    *,
    seconds: float = 10.0,
    dt: float = 0.01,
    every: int = 1,
    candidates: int = 48,
    rounds: int = 8,
    seed: int = 0,
    cost: Callable[[Merit, float], Scalar] = regulation_cost,
    estimator: AbstractEstimator | None = None,
    progress: Progress = quiet,
) -> Found:
    """Search `box` (name of a gain -> its positive bounds, searched by logarithm) for the least mean cost over `targets`.

    Raises ValueError for bounds that are not positive and rising.
    """
    wrong = {name: bounds for name, bounds in box.items() if not 0.0 < bounds[0] < bounds[1]}
    if wrong:
        raise ValueError(f"gains are searched by logarithm: bounds must be positive and rise, not {wrong}.")
    names = tuple(box)
    low, high = (np.log([bounds[side] for bounds in box.values()]) for side in (0, 1))
    draw = np.random.default_rng(seed)
    points = low + (high - low) * draw.random((candidates, len(names)))
    middle, spread = 0.5 * (low + high), (high - low) / np.sqrt(12.0)
    best: tuple[float, np.ndarray, Merit] | None = None
    for number in range(rounds):
        found = merits_of(
            system, controller, names, jnp.exp(points), jnp.asarray(targets), seconds, dt, every, estimator
        )
        costs = np.asarray(jax.vmap(jax.vmap(lambda one: cost(one, seconds)))(found).mean(axis=1))
        costs = np.where(np.isfinite(costs), costs, np.inf)
        order = np.argsort(costs)
        first = int(order[0])
        if best is None or costs[first] < best[0]:
            best = (float(costs[first]), np.exp(points[first]), jax.tree.map(operator.itemgetter(first), found))
        elite = points[order[: max(2, int(ELITE * candidates))]]
        middle, spread = elite.mean(axis=0), KEPT * spread + (1.0 - KEPT) * elite.std(axis=0)
        points = np.clip(middle + spread * draw.standard_normal(points.shape), low, high)
        points[0] = np.log(best[1])
        progress(Stage("searching gains", (number + 1) / rounds))
    assert best is not None
    gains = {name: float(value) for name, value in zip(names, best[1], strict=True)}
    return Found(gains, best[0], best[2], candidates * rounds)
