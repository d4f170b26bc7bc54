r"""One number from the terms of many closed loops, and its gradient in the gains.

A loop costs $c_m = \sum_j w_j q_{mj}$. Over the loops of one candidate

    nominal        mean of c_m over the plants as believed
    worst          T log(mean exp(c_m / T)), which is the largest c_m for T -> 0
    mean-variance  mean + K sqrt(variance)

A limit, $g_{mj} = q_{mj}/l_j - 1 \le 0$ in every loop, is met by the augmented Lagrangian (Nocedal & Wright 2006, eq. 17.65
in its form for inequalities)

    F + sum_{m, j} [max(0, lambda + rho g)^2 - lambda^2] / (2 rho),      lambda <- max(0, lambda + rho g).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.tune.evaluate import Evaluation
from smajax.control.tune.scenarios import Scenarios
from smajax.control.tune.terms import TERMS
from smajax.core.names import close_matches
from smajax.model.types import Scalar

OBJECTIVES = ("nominal", "worst", "mean-variance")
REGULATION = {"settling_time": 1.0, "overshoot": 1.0, "steady_error": 2.0}  # as `gain_search.regulation_cost`
SPREAD = 1.0  # K


@dataclass(frozen=True)
class Goal:
    """What is to be small, and what is to stay below a limit; in the units of `TERMS`.

    Raises ValueError for an objective or a term there is not, weights below zero or all zero, limits that are not positive.
    """

    objective: str = "worst"
    weights: Mapping[str, float] = field(default_factory=lambda: dict(REGULATION))
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.objective not in OBJECTIVES:
            raise ValueError(
                f"no objective `{self.objective}`{close_matches(self.objective, OBJECTIVES, 'there are')}."
            )
        for name in (*self.weights, *self.limits):
            if name not in TERMS:
                raise ValueError(f"no term `{name}`{close_matches(name, TERMS, 'there are')}.")
        if min(self.weights.values(), default=0.0) < 0.0 or not any(self.weights.values()):
            raise ValueError(f"weights are no less than 0, and one at least is more; not {dict(self.weights)}.")
        if min(self.limits.values(), default=1.0) <= 0.0:
            raise ValueError(f"limits are more than 0; not {dict(self.limits)}.")

    @property
    def weight_vector(self) -> np.ndarray:
        """(terms,)"""
        return np.asarray([self.weights.get(name, 0.0) for name in TERMS])

    @property
    def limited(self) -> list[int]:
        """Which terms have a limit."""
        return [k for k, name in enumerate(TERMS) if name in self.limits]

    @property
    def used(self) -> np.ndarray:
        """Which terms have a weight or a limit."""
        return np.union1d(np.flatnonzero(self.weight_vector), np.asarray(self.limited, int))

    @property
    def bounds(self) -> np.ndarray:
        """Their limits."""
        return np.asarray([self.limits[name] for name in TERMS if name in self.limits])

    def scenarios(self, scenarios: Scenarios) -> np.ndarray:
        """(M,) bool: whose cost counts."""
        return scenarios.nominal if self.objective == "nominal" else np.ones(scenarios.size, bool)

    def cost(self, judged: np.ndarray, scenarios: Scenarios) -> np.ndarray:
        """Cost of every candidate (C,) by what was asked for: the settling time itself, and the worst loop itself."""
        each = judged @ self.weight_vector
        counted = each[..., self.scenarios(scenarios)]
        if self.objective == "worst":
            whole = counted.max(axis=-1)
        else:
            whole = counted.mean(axis=-1)
            if self.objective == "mean-variance":
                whole = whole + SPREAD * counted.std(axis=-1)
        return np.where(np.isfinite(each).all(axis=-1), whole, np.inf)

    def excess(self, judged: np.ndarray) -> np.ndarray:
        """By which share the worst loop of every candidate (C,) exceeds a limit; 0 where all are met."""
        if not self.limits:
            return np.zeros(judged.shape[:-2])
        over = (judged[..., self.limited] / self.bounds - 1.0).max(axis=(-2, -1))
        return np.where(np.isnan(over), np.inf, np.maximum(over, 0.0))


def rank(cost: np.ndarray, excess: np.ndarray) -> np.ndarray:
    """A number by which candidates are ordered: those within the limits by cost, the others after them by excess."""
    finite = np.minimum(np.where(np.isfinite(cost), cost, np.inf), 1e8)
    within = np.where(np.isfinite(cost), finite, np.inf)
    return np.where(excess > 0.0, 1e9 * (1.0 + np.minimum(excess, 1e6)) + finite, within)


def _smooth(
    terms: Scalar, good: Scalar, nominal: Scalar, goal: Goal, temperature: Scalar, multipliers: Scalar, rho: Scalar
) -> Scalar:
    each = terms @ jnp.asarray(goal.weight_vector)
    counted = good & (nominal if goal.objective == "nominal" else True)
    count = jnp.maximum(jnp.sum(counted), 1)
    mean = jnp.sum(jnp.where(counted, each, 0.0)) / count
    whole = mean
    if goal.objective == "worst":
        shown = jnp.where(counted, each / temperature, -jnp.inf)
        whole = temperature * (jax.nn.logsumexp(shown) - jnp.log(count))
    elif goal.objective == "mean-variance":
        variance = jnp.sum(jnp.where(counted, (each - mean) ** 2, 0.0)) / count
        whole = mean + SPREAD * jnp.sqrt(variance + 1e-12)
    if goal.limits:
        over = terms[:, jnp.asarray(goal.limited)] / jnp.asarray(goal.bounds) - 1.0
        pushed = jnp.maximum(0.0, multipliers + rho * over)
        whole += jnp.sum(jnp.where(good[:, None], pushed**2 - multipliers**2, 0.0)) / (2.0 * rho)
    return whole


def value_and_gradient(
    goal: Goal,
    seen: Evaluation,
    scenarios: Scenarios,
    temperature: np.ndarray,
    multipliers: np.ndarray,
    rho: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(objective of every candidate (C,), its gradient in the unit cube (C, gains)).

    Loops whose numbers are none, and those whose gradients are unusable, are left out of both.
    """
    good = ~(seen.failed | seen.unusable(goal.used))
    terms = jnp.asarray(np.where(good[..., None], np.nan_to_num(seen.terms), 0.0))
    gradients = np.where(good[..., None, None], np.nan_to_num(seen.gradients), 0.0)
    one = jax.value_and_grad(_smooth)
    given = [jnp.asarray(array) for array in (terms, good, temperature, multipliers, rho)]
    values, by_terms = jax.vmap(lambda t, g, s, m, r: one(t, g, jnp.asarray(scenarios.nominal), goal, s, m, r))(*given)
    return np.asarray(values), np.einsum("cmt,cmtp->cp", np.asarray(by_terms), gradients)


def multiplied(goal: Goal, terms: np.ndarray, multipliers: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """The multipliers (C, M, limits) after terms (C, M, terms) were seen; rho (C,)."""
    over = np.nan_to_num(terms[..., goal.limited]) / goal.bounds - 1.0
    return np.maximum(0.0, multipliers + rho[:, None, None] * over)
