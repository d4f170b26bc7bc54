"""Gains by a search over batches of closed loops: cross-entropy, every candidate on every set point in one `vmap`.

It needs no derivative, so it works for controllers that switch. Its results are stored with the box, the cost and the seed
in `studies/gains`.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.figures_of_merit import Merit, evaluated_loop
from smajax.control.reference import clock, constant
from smajax.core.parameters import set_vector
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System
from smajax.model.types import Scalar

ELITE = 0.2  # fraction of the candidates from which the next round is drawn
INERTIA = 0.3  # weight of the old spread in the new one


@dataclass(frozen=True)
class SearchSettings:
    """Length and steps of each closed loop, and the size of the search."""

    seconds: float = 10.0
    dt: float = 0.01  # s
    every: int = 1  # the controller is called every so many steps
    candidates: int = 48
    rounds: int = 8
    seed: int = 0


DEFAULT_SETTINGS = SearchSettings()


@dataclass(frozen=True)
class SearchResult:
    """The best gains of a search, their cost, and each set point's figures of merit (arrays of shape (targets,))."""

    gains: dict[str, float]
    cost: float
    merits: Merit
    tried: int


def regulation_cost(one: Merit, seconds: float) -> Scalar:
    """Of an angle: seconds to settle (twice the run where it never does), one more a degree of overshoot, two a degree of steady error."""
    settling = jnp.where(jnp.isfinite(one.settling_time), one.settling_time, 2.0 * seconds)
    return settling + jnp.degrees(one.overshoot) + 2.0 * jnp.degrees(one.steady_error)


@eqx.filter_jit
def merits_of(
    system: System,
    controller: AbstractController,
    names: tuple[str, ...],
    gains: jax.Array,
    targets: jax.Array,
    settings: SearchSettings,
    estimator: AbstractEstimator | None = None,
) -> Merit:
    """Figures of merit of every row of `gains` (candidates, names) at every set point: arrays (candidates, targets)."""
    time = clock(settings.seconds, settings.dt)

    def one(row: jax.Array, target: Scalar) -> Merit:
        tuned = set_vector(controller, names, row)
        setup = ClosedLoopSetup(system, tuned, constant(time, target), settings.dt, settings.every, estimator)
        return evaluated_loop(setup)[0]

    return jax.vmap(lambda row: jax.vmap(lambda target: one(row, target))(targets))(gains)


def search_gains(
    system: System,
    controller: AbstractController,
    box: Mapping[str, tuple[float, float]],
    targets: Sequence[float],
    settings: SearchSettings = DEFAULT_SETTINGS,
    *,
    cost: Callable[[Merit, float], Scalar] = regulation_cost,
    estimator: AbstractEstimator | None = None,
    progress: Progress = quiet,
) -> SearchResult:
    """Search `box` (name of a gain -> its positive bounds, searched by logarithm) for the least mean cost over `targets`.

    Raises ValueError for bounds that are not positive and rising.
    """
    wrong = {name: bounds for name, bounds in box.items() if not 0.0 < bounds[0] < bounds[1]}
    if wrong:
        raise ValueError(f"gains are searched by logarithm: bounds must be positive and rise, not {wrong}.")
    names = tuple(box)
    low, high = (np.log([bounds[side] for bounds in box.values()]) for side in (0, 1))
    draw = np.random.default_rng(settings.seed)
    points = low + (high - low) * draw.random((settings.candidates, len(names)))
    middle, spread = 0.5 * (low + high), (high - low) / np.sqrt(12.0)
    best: tuple[float, np.ndarray, Merit] | None = None
    for number in range(settings.rounds):
        merits = merits_of(system, controller, names, jnp.exp(points), jnp.asarray(targets), settings, estimator)
        costs = np.asarray(jax.vmap(jax.vmap(lambda one: cost(one, settings.seconds)))(merits).mean(axis=1))
        costs = np.where(np.isfinite(costs), costs, np.inf)
        order = np.argsort(costs)
        first = int(order[0])
        if best is None or costs[first] < best[0]:
            best = (float(costs[first]), np.exp(points[first]), jax.tree.map(operator.itemgetter(first), merits))
        elite = points[order[: max(2, int(ELITE * settings.candidates))]]
        middle, spread = elite.mean(axis=0), INERTIA * spread + (1.0 - INERTIA) * elite.std(axis=0)
        points = np.clip(middle + spread * draw.standard_normal(points.shape), low, high)
        points[0] = np.log(best[1])
        progress(Stage("searching gains", (number + 1) / settings.rounds))
    assert best is not None
    gains = {name: float(value) for name, value in zip(names, best[1], strict=True)}
    return SearchResult(gains, best[0], best[2], settings.candidates * settings.rounds)
