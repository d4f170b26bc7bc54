r"""Sequential linear programming in a trust region, one for each start (after Madsen 1975, minimax by linear programs).

Every term q of every loop is known with its gradient at the centre, so the next point minimises, over the steps
$|d_k| \le \Delta$, the objective of the linearised loops, each term bounded below by zero,

    worst   min t + MU v:   sum_j w_j q_mj <= t,   q_mj >= q_mj(0) + grad q_mj . d,   q_mj >= 0,
                            q_mj(0) + grad q_mj . d <= l_j (1 + v),   v >= 0,

or their mean in the place of t. It becomes the centre when it is better; otherwise Delta shrinks. Linear programs take
into account loops that become the worst on the way, which the gradient of the largest cost does not. A loop with an
unusable gradient (a limit cycle multiplies a difference in every swing) is constant in the model; where the model
predicts no improvement the next point is drawn from the trust region.

No `AbstractSearch` of optimistix: its trust regions predict the reduction from a gradient and a Hessian (`FunctionInfo`),
and this objective has neither; the prediction is the optimum of the linear program, known only with the step. optimistix
has no linear programming, so both halves would only wrap `linprog`.
"""

from __future__ import annotations

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.control.tune.evaluate import Evaluation
from smajax.control.tune.objective import SPREAD, Goal
from smajax.control.tune.scenarios import Scenarios

FIRST, WIDEST, NARROWEST = 0.15, 0.3, 2e-3  # Delta, share of the box by logarithm; below the last a start has ended
GOOD, WIDER, NARROWER = 0.5, 2.0, 0.4  # share of the predicted reduction from which Delta grows, and by how much
MIN_REDUCTION = 1e-3  # a smaller predicted one is none
PENALTY = 30.0  # MU, cost of a limit exceeded by its own size
Memory = dict[str, np.ndarray]


def begin(points: np.ndarray) -> Memory:
    """State before the first evaluation: arrays by start."""
    count = len(points)
    return {
        "centre": points.copy(),
        "value": np.full(count, np.inf),
        "predicted": np.full(count, -np.inf),
        "radius": np.full(count, FIRST),
    }


def value(goal: Goal, terms: np.ndarray, scenarios: Scenarios) -> np.ndarray:
    """The objective of terms (C, M, terms) and the penalty of its limits, (C,)."""
    return goal.cost(terms, scenarios) + PENALTY * goal.excess(terms)


def _shares(goal: Goal, costs: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Weight of each loop in a mean, (M,), not negative."""
    shares = counted / counted.sum()
    if goal.objective == "mean-variance":
        inside = costs[counted]
        shares = shares * (1.0 + SPREAD * (costs - inside.mean()) / max(float(inside.std()), 1e-9))
    return np.maximum(shares, 0.0)


def step(
    goal: Goal, terms: np.ndarray, gradients: np.ndarray, scenarios: Scenarios, centre: np.ndarray, radius: float
) -> tuple[np.ndarray, float]:
    """(next point, the predicted value there) from terms (M, terms) and gradients (M, terms, gains) at the centre."""
    count, gains = len(terms), len(centre)
    used, counted = np.flatnonzero(goal.weight_vector), goal.scenarios(scenarios)
    weights, pieces = goal.weight_vector[used], np.flatnonzero(counted)
    # Unknowns: d (gains), t, v, q (loops that count x terms used).
    worst, lines = goal.objective == "worst", len(pieces) * len(used)
    sparse, cost = scipy.sparse, np.zeros(gains + 2 + lines)
    cost[gains], cost[gains + 1] = float(worst), PENALTY
    if not worst:
        shares = _shares(goal, terms @ goal.weight_vector, counted)[pieces]
        cost[gains + 2 :] = np.outer(shares, weights).ravel()
    steep = gradients[pieces][:, used].reshape(lines, gains)
    rows = [sparse.hstack([sparse.csr_matrix(steep), sparse.csr_matrix((lines, 2)), -sparse.identity(lines)])]
    least = [-terms[pieces][:, used].ravel()]
    if worst:
        own = sparse.kron(sparse.identity(len(pieces)), weights[None, :])
        below = sparse.csr_matrix(-np.ones((len(pieces), 1)))
        blank = sparse.csr_matrix((len(pieces), gains)), sparse.csr_matrix((len(pieces), 1))
        rows.append(sparse.hstack([blank[0], below, blank[1], own]))
        least.append(np.zeros(len(pieces)))
    for k, bound in zip(goal.limited, goal.bounds, strict=True):
        rows.append(
            sparse.hstack(
                [
                    sparse.csr_matrix(gradients[:, k] / bound),
                    sparse.csr_matrix((count, 1)),
                    sparse.csr_matrix(-np.ones((count, 1))),
                    sparse.csr_matrix((count, lines)),
                ]
            )
        )
        least.append(1.0 - terms[:, k] / bound)
    box = [(max(-radius, -here), min(radius, 1.0 - here)) for here in centre]
    ends = [*box, (None, None) if worst else (0.0, 0.0), (0.0, None), *[(0.0, None)] * lines]
    solution = scipy.optimize.linprog(
        cost, A_ub=sparse.vstack(rows, format="csr"), b_ub=np.concatenate(least), bounds=ends
    )
    if solution.x is None:  # a matrix that the solver rejects: no reduction is predicted
        return centre, np.inf
    return np.clip(centre + solution.x[:gains], 0.0, 1.0), float(solution.fun)


def move(
    goal: Goal, seen: Evaluation, scenarios: Scenarios, points: np.ndarray, memory: Memory, draw: np.random.Generator
) -> tuple[np.ndarray, Memory, np.ndarray]:
    """(next points, memory, which starts have ended) after `points` (C, gains) were evaluated."""
    new = {name: array.copy() for name, array in memory.items()}
    values = value(goal, seen.terms, scenarios)
    calm = ~(seen.failed | seen.unusable(goal.used))
    shape = (len(points), *seen.gradients.shape[1:])
    terms, gradients = new.setdefault("terms", np.zeros(shape[:3])), new.setdefault("gradients", np.zeros(shape))
    following = points.copy()
    for k in range(len(points)):
        before = new["value"][k]
        first = not np.isfinite(before)
        if first or values[k] < before:
            good = before - values[k] > GOOD * (before - new["predicted"][k])
            new["radius"][k] *= WIDER if not first and good else 1.0
            new["centre"][k], new["value"][k] = points[k], values[k]
            terms[k] = np.nan_to_num(seen.terms[k])
            gradients[k] = np.where(calm[k][:, None, None], seen.gradients[k], 0.0)
        else:
            new["radius"][k] *= NARROWER
        radius = new["radius"][k] = min(new["radius"][k], WIDEST)
        centre = new["centre"][k]
        proposal, new["predicted"][k] = step(goal, terms[k], gradients[k], scenarios, centre, float(radius))
        drawn = np.clip(centre + radius * draw.uniform(-1.0, 1.0, len(centre)), 0.0, 1.0)
        improves = new["predicted"][k] < new["value"][k] - MIN_REDUCTION
        following[k] = proposal if improves else drawn
    return following, new, new["radius"] < NARROWEST
