"""Adam (optax) on the smooth objective, limits by the augmented Lagrangian; a start without progress returns to its best point.

With limits `trust` comes much further in as many loops (studies/tuning).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.tune.evaluate import Evaluation
from smajax.control.tune.objective import Goal, multiplied, rank, value_and_gradient
from smajax.control.tune.scenarios import Scenarios
from smajax.core.extras import optional_package

STEP = 0.06  # of a gain, share of its box by logarithm
LONGEST = 10.0  # units of the cost per box: longer gradients are cut to that
PATIENCE, SHORTER, SHORTEST = 2, 0.5, 0.02  # rounds without a better candidate; the step is then shorter, at least ...
SHARP = 0.1  # T of the soft maximum, share of the cost
WEIGHT, HEAVIER, HEAVIEST = 4.0, 1.6, 200.0  # rho at first, after every update of the multipliers, and at most
UPDATED = 4  # rounds between two of them
Memory = dict[str, np.ndarray]


@lru_cache(maxsize=1)
def rule() -> Any:
    """optax's gradient transformation. MissingExtraError says how to install optax."""
    optax = optional_package("optax", "tune", "`--by adam`", "or take `--by trust-region`")
    return optax.chain(optax.clip_by_global_norm(LONGEST), optax.adam(STEP, b1=0.7, b2=0.9))


def begin(points: np.ndarray, scenarios: Scenarios, limits: int) -> Memory:
    """Nothing known yet: arrays by start."""
    count = len(points)
    state = jax.tree.leaves(jax.vmap(rule().init)(jnp.asarray(points)))
    return {f"moment {k}": np.asarray(leaf) for k, leaf in enumerate(state)} | {
        "reach": np.ones(count),
        "waited": np.zeros(count, int),
        "rounds": np.zeros(count, int),
        "best": points.copy(),
        "best rank": np.full(count, np.inf),
        "multipliers": np.zeros((count, scenarios.size, limits)),
        "rho": np.full(count, WEIGHT),
    }


def move(
    goal: Goal, seen: Evaluation, scenarios: Scenarios, points: np.ndarray, memory: Memory, draw: np.random.Generator
) -> tuple[np.ndarray, Memory, np.ndarray]:
    """(next points, memory, which starts have ended: none) after `points` (C, gains) were seen."""
    new = {name: array.copy() for name, array in memory.items()}
    cost = goal.cost(seen.terms, scenarios)
    order = rank(cost, goal.excess(seen.terms))
    better = order < new["best rank"]
    new["best"][better], new["best rank"][better] = points[better], order[better]
    sharp = np.where(np.isfinite(cost), SHARP * np.maximum(cost, 1e-6), 1.0)
    gradient = value_and_gradient(goal, seen, scenarios, sharp, new["multipliers"], new["rho"])[1]
    like = jax.tree.structure(jax.vmap(rule().init)(jnp.asarray(points)))
    names = [name for name in new if name.startswith("moment ")]
    state = jax.tree.unflatten(like, [jnp.asarray(new[name]) for name in names])
    steps, state = jax.vmap(rule().update)(jnp.asarray(np.nan_to_num(gradient)), state)
    following = np.clip(points + new["reach"][:, None] * np.asarray(steps), 0.0, 1.0)
    # Copies: what jax gives must not be written to.
    new |= {name: np.array(leaf) for name, leaf in zip(names, jax.tree.leaves(state), strict=True)}
    new["waited"], new["rounds"] = np.where(better, 0, new["waited"] + 1), new["rounds"] + 1
    back = new["waited"] > PATIENCE
    following[back], new["waited"][back] = new["best"][back], 0
    new["reach"][back] = np.maximum(SHORTER * new["reach"][back], SHORTEST)
    for name in names:
        new[name][back] = 0
    due = new["rounds"] % UPDATED == 0
    if goal.limits and due.any():
        heavier = multiplied(goal, seen.terms, new["multipliers"], new["rho"])
        new["multipliers"][due] = heavier[due]
        new["rho"][due] = np.minimum(HEAVIER * new["rho"][due], HEAVIEST)
    return following, new, np.zeros(len(points), bool)
