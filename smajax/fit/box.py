"""Levenberg-Marquardt within a box, many fits at once: derivatives in one batched program, the small algebra here.

The box is kept by holding what a step would carry beyond its bound, not by a map onto the whole line: on such a map a
bound is infinitely far away and a narrow valley bends, and a fit that takes 20 steps here took 150 there
(`studies/coverage`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import fields as fields_of

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import lsq_linear

from smajax.fit.kept import Kept
from smajax.fit.problem import Lane, Problem
from smajax.fit.progress import Progress, quiet
from smajax.fit.shown import shown_and_slopes

MOST_STEPS = 120
ENOUGH = 1e-8  # of the cost: what a step that is the last one may still lower it by, and promise to; scipy's too
STILL = 1e-12  # of the box
DAMPED = 1e-1  # share of the squared columns that damping begins with
HOPELESS = 1e10  # damping at which no step is a better one
AT_MOST = 0.7  # of the way to a bound
NEAR = 1e-3  # of the box: from here on the bound itself may be reached
WIDE = 24  # lanes at once from which on a second, narrower program is worth its compilation
NARROWER = 6  # a batch as narrow by this takes a third of the time
STRAGGLERS = 3  # narrow batches at most
BLIND = 1e-14  # of the largest squared column: a parameter that nothing depends on


@dataclass(frozen=True)
class Fit:
    """One fit ended."""

    values: np.ndarray  # every parameter, and the dummy: shape (P + 1,)
    cost: float  # sum of squared residuals, misfit over noise
    converged: bool
    reason: str
    steps: int


@dataclass
class _Walk:
    """Where one fit is; places are shares of the box."""

    place: np.ndarray
    cost: float
    slope: np.ndarray  # J^T r
    square: np.ndarray  # J^T J
    scale: np.ndarray  # largest squared columns so far
    damping: float = DAMPED
    growth: float = 2.0
    steps: int = 0
    reason: str = ""


@eqx.filter_jit
def _asked(lanes: Lane, places: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(values, derivatives of the values by the place) of every lane: (L, P + 1) and (L, slots, P + 1)."""

    def one(lane: Lane, place: jax.Array) -> tuple[jax.Array, jax.Array]:
        return _values_at(lane, place), jax.jacfwd(lambda there: _values_at(lane, there))(place).T

    return jax.vmap(one)(lanes, places)


def _values_at(lane: Lane, place: jax.Array) -> jax.Array:
    return lane.values.at[lane.slots].set(lane.low + place * (lane.high - lane.low))


@eqx.filter_jit
def _summed(
    problem: Problem, lanes: Lane, places: jax.Array, outputs: jax.Array | None, shown: jax.Array, slopes: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """(r^T r, J^T r, J^T J) of every lane, from what its sensors show and how that moves with its place."""

    def one(
        lane: Lane, place: jax.Array, output: jax.Array | None, shown: jax.Array, slopes: jax.Array
    ) -> tuple[jax.Array, jax.Array, jax.Array]:
        here = problem.with_output(output)

        def residual(place: jax.Array, shown: jax.Array) -> jax.Array:
            return here.residual_of(shown, _values_at(lane, place), lane.weights)

        value = residual(place, shown)
        along = lambda way, slope: jax.jvp(residual, (place, shown), (way, slope))[1]  # noqa: E731
        jacobian = jax.vmap(along)(jnp.eye(len(place)), slopes)
        return value @ value, jacobian @ value, jacobian @ jacobian.T

    return eqx.filter_vmap(one)(lanes, places, outputs, shown, slopes)


def _normal_equations(
    problem: Problem, lanes: Lane, places: jax.Array, outputs: jax.Array | None
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """(r^T r, J^T r, J^T J) of every lane at its place, by shares of its box."""
    values, towards = (np.asarray(one) for one in _asked(lanes, places))
    shown, slopes = shown_and_slopes(problem, values, towards)
    return _summed(problem, lanes, places, outputs, jnp.asarray(shown), jnp.asarray(slopes))


def _step(walk: _Walk) -> np.ndarray:
    """The damped step within its bounds, solved exactly: least squares by the Cholesky factor of the damped equations."""
    least = BLIND * max(float(walk.scale.max()), 1e-300)
    damped = walk.square + walk.damping * np.diag(np.maximum(walk.scale, least))
    # Most of the way to a bound at a time: a first long step must not end in a corner that no later one leads out of.
    low = np.where(walk.place < NEAR, 0.0, (1.0 - AT_MOST) * walk.place) - walk.place
    high = np.where(walk.place > 1.0 - NEAR, 1.0, 1.0 - (1.0 - AT_MOST) * (1.0 - walk.place)) - walk.place
    try:
        factor = np.linalg.cholesky(damped)
    except np.linalg.LinAlgError:
        return np.zeros_like(walk.place)  # to rounding: more damping makes it positive
    free = -np.linalg.solve(damped, walk.slope)
    if np.all((low <= free) & (free <= high)):
        return free
    # Without a point between them a bound is no choice.
    wide = np.where(high > low, high, low + STILL)
    return np.clip(lsq_linear(factor.T, -np.linalg.solve(factor, walk.slope), (low, wide), method="bvls").x, low, high)


def _judged(walk: _Walk, step: np.ndarray, cost: float, slope: np.ndarray, square: np.ndarray) -> None:
    """Take the step or not, and say so when it was the last."""
    promised = -(2.0 * walk.slope @ step + step @ walk.square @ step)
    known = np.isfinite(cost) and np.isfinite(slope).all() and np.isfinite(square).all()
    gained = walk.cost - cost if known else -np.inf
    walk.steps += 1
    small = 0.0 < promised < ENOUGH * walk.cost
    if gained > 0.0:
        share = gained / max(promised, 1e-300)
        walk.place, walk.cost = np.clip(walk.place + step, 0.0, 1.0), cost
        walk.slope, walk.square = slope, square
        walk.scale = np.maximum(walk.scale, np.diag(square))
        walk.damping *= max(0.1, 1.0 - (2.0 * min(share, 1.0) - 1.0) ** 3)
        walk.growth = 2.0
        if small and gained < ENOUGH * walk.cost:
            walk.reason = "it has converged, no step lowers the cost by more than 1e-8 of it"
    else:
        walk.damping *= walk.growth
        walk.growth *= 2.0
        if small or walk.damping > HOPELESS:
            walk.reason = "it has converged, no step lowers the cost any more"


def _cut(lanes: int, at_once: int) -> list[tuple[int, int]]:
    """(first lane, width) of each batch. A few stragglers do not pay for a wide batch that is filled up."""
    narrow = max(at_once // NARROWER, 1)
    widths, start = [], 0
    while start < lanes:
        few = at_once >= WIDE and lanes - start <= STRAGGLERS * narrow
        widths.append((start, narrow if few else at_once))
        start += widths[-1][1]
    return widths


def _packed(walks: Sequence[_Walk], rounds: int) -> dict[str, np.ndarray]:
    """Where all fits are, as arrays."""
    fields = {field.name: np.asarray([getattr(walk, field.name) for walk in walks]) for field in fields_of(_Walk)}
    return {**fields, "rounds": np.asarray(rounds)}


def _unpacked(record: Mapping[str, np.ndarray]) -> list[_Walk]:
    names = [field.name for field in fields_of(_Walk)]
    rows = zip(*(record[name] for name in names), strict=True)
    return [_Walk(*(value if np.ndim(value) else value.item() for value in row)) for row in rows]


def fit_in_box(
    problem: Problem,
    lanes: Sequence[Lane],
    *,
    outputs: np.ndarray | None = None,
    at_once: int = 8,
    most: int = MOST_STEPS,
    kept: Kept | None = None,
    progress: Progress = quiet,
    what: str = "fitting",
) -> list[Fit]:
    """Fit every lane from its own values; all lanes have the same number of slots.

    With `kept`, where every fit is is written as it goes, and the same call goes on from there to the same end.

    `outputs`, (lanes, R, N): measured outputs of each lane's own, as in repeated experiments. Lanes that are not ended
    go `at_once` at a time, so one compilation serves any number of them, and none waits for another; the last ones of
    many go fewer at a time, by a second compilation.
    """

    def place_of(lane: Lane) -> np.ndarray:
        low, high = np.asarray(lane.low), np.asarray(lane.high)
        return np.clip((np.asarray(lane.values)[np.asarray(lane.slots)] - low) / (high - low), 0.0, 1.0)

    def evaluated(some: Sequence[int], places: Sequence[np.ndarray]) -> list[tuple[float, np.ndarray, np.ndarray]]:
        found: list[tuple[float, np.ndarray, np.ndarray]] = []
        for start, width in _cut(len(some), at_once):
            part = list(some[start : start + width])
            filled = part + [part[0]] * (width - len(part))
            at = list(places[start : start + width])
            at += [at[0]] * (width - len(part))
            batch = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(lanes[lane] for lane in filled))
            own = None if outputs is None else jnp.asarray(outputs[np.asarray(filled)])
            answers = [np.asarray(each) for each in _normal_equations(problem, batch, jnp.asarray(np.stack(at)), own)]
            found += [(float(cost), slope, square) for cost, slope, square in zip(*answers, strict=True)][: len(part)]
        return found

    everyone = range(len(lanes))
    kept = kept or Kept()
    key = kept.key((problem, list(lanes)), "fit in box", outputs if outputs is not None else "", at_once, most)
    known = kept.load(key)
    if known is not None:
        walks, begun = _unpacked(known), int(known["rounds"])
    else:
        walks, begun = [], 0
        places = [place_of(lane) for lane in lanes]
        for place, (cost, slope, square) in zip(places, evaluated(everyone, places), strict=True):
            lost = not (np.isfinite(cost) and np.isfinite(slope).all() and np.isfinite(square).all())
            walk = _Walk(place, cost if not lost else np.inf, slope, square, np.diag(square).copy())
            walk.reason = "the model gives no number at the start" if lost else ""
            walks.append(walk)
    for number in range(begun, most):
        kept.save(key, _packed(walks, number), last=False)
        going = [lane for lane in everyone if not walks[lane].reason]
        progress(what, max(1.0 - len(going) / len(lanes), number / most))
        if not going:
            break
        steps = [_step(walks[lane]) for lane in going]
        tried = [np.clip(walks[lane].place + step, 0.0, 1.0) for lane, step in zip(going, steps, strict=True)]
        for lane, step, answer in zip(going, steps, evaluated(going, tried), strict=True):
            _judged(walks[lane], step, *answer)
    kept.save(key, _packed(walks, most))
    progress(what, 1.0)
    ended = []
    for own, walk in zip(lanes, walks, strict=True):
        values = np.array(own.values)
        low, high = np.asarray(own.low), np.asarray(own.high)
        values[np.asarray(own.slots)] = low + walk.place * (high - low)
        done = bool(walk.reason) and np.isfinite(walk.cost)
        ended.append(Fit(values, walk.cost, done, walk.reason or f"{most} steps were not enough", walk.steps))
    return ended
