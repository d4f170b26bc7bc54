"""Levenberg-Marquardt within a box, many fits at once: derivatives in one batched program, the small algebra here.

The box is kept by holding what a step would carry beyond its bound, not by a map onto the whole line: on such a map a
bound is infinitely far away and a narrow valley bends, and a fit that takes 20 steps here took 150 there
(`studies/coverage`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from dataclasses import fields as fields_of
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from smajax.core.progress import Progress, Stage, quiet
from smajax.core.result_cache import Kept
from smajax.fit.predicted import in_parts, shown_and_slopes
from smajax.fit.problem import Lane, Problem

MOST_STEPS = 120
ENOUGH = 1e-8  # of the cost: what a step that is the last one may still lower it by, and promise to; scipy's too
STILL = 1e-12  # of the box
DAMPED = 1e-1  # share of the squared columns that damping begins with
HOPELESS = 1e10  # damping at which no step is a better one
AT_MOST = 0.7  # of the way to a bound
NEAR = 1e-3  # of the box: from here on the bound itself may be reached
BLIND = 1e-14  # of the largest squared column: a parameter that nothing depends on


@dataclass(frozen=True)
class Fit:
    """One fit ended."""

    values: np.ndarray  # every parameter, shape (P,)
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


Equations = tuple[float, np.ndarray, np.ndarray]  # r^T r, J^T r, J^T J of one fit, by shares of its box


def _normal_equations(
    problem: Problem, lanes: Sequence[Lane], places: Sequence[np.ndarray], outputs: np.ndarray | None
) -> list[Equations]:
    """Of every lane at its place. Directions of all lanes go side by side, whatever each of them frees."""
    points = np.stack([lane.at(place) for lane, place in zip(lanes, places, strict=True)])
    most = max(1, *(len(lane.slots) for lane in lanes))
    towards = np.zeros((len(lanes), most, points.shape[1]))
    for own, lane in zip(towards, lanes, strict=True):
        own[np.arange(len(lane.slots)), lane.slots] = lane.high - lane.low
    shown, slopes = shown_and_slopes(problem, points, towards)
    found = []
    for k, (lane, place) in enumerate(zip(lanes, places, strict=True)):
        measured = problem.measured if outputs is None else outputs[k]
        weight = np.repeat(np.sqrt(lane.weights), len(problem.batch.outputs))[:, None] / np.asarray(problem.noise)
        residual = weight * problem.centred(measured - shown[k])
        jacobian = -weight * problem.centred(slopes[k, : len(lane.slots)])
        value = np.concatenate([residual.ravel(), problem.priors.rows(points[k]), lane.tie * (place - lane.place)])
        known = problem.priors.slopes(points[k])[:, lane.slots] * (lane.high - lane.low)
        rows = np.concatenate([jacobian.reshape(len(lane.slots), residual.size), known.T, np.diag(lane.tie)], axis=1)
        with np.errstate(over="ignore", invalid="ignore"):  # a step to where a load jumps: it will not be taken
            found.append((float(value @ value), rows @ value, rows @ rows.T))
    return found


def _step(walk: _Walk) -> np.ndarray:
    """The damped step within its bounds, solved exactly: least squares by the Cholesky factor of the damped equations."""
    least = BLIND * max(float(walk.scale.max()), 1e-300)
    damped = walk.square + walk.damping * np.diag(np.maximum(walk.scale, least))
    # Most of the way to a bound at a time: a first long step must not end in a corner that no later one leads out of.
    low = np.where(walk.place < NEAR, 0.0, (1.0 - AT_MOST) * walk.place) - walk.place
    high = np.where(walk.place > 1.0 - NEAR, 1.0, 1.0 - (1.0 - AT_MOST) * (1.0 - walk.place)) - walk.place
    try:
        factor = np.linalg.cholesky(damped)
        free = -np.linalg.solve(damped, walk.slope)
    except np.linalg.LinAlgError:
        return np.zeros_like(walk.place)  # to rounding: more damping makes it positive
    if np.all((low <= free) & (free <= high)):
        return free
    # Without a point between them a bound is no choice.
    wide = np.where(high > low, high, low + STILL)
    with np.errstate(divide="ignore", invalid="ignore"):  # scipy's way along a bound may be of no length
        held = lsq_linear(factor.T, -np.linalg.solve(factor, walk.slope), (low, wide), method="bvls").x
    return np.clip(held, low, high) if np.isfinite(held).all() else np.zeros_like(walk.place)


def _judged(
    walk: _Walk, step: np.ndarray, cost: float, slope: np.ndarray, square: np.ndarray, enough: float = ENOUGH
) -> None:
    """Take the step or not, and say so when it was the last."""
    promised = -(2.0 * walk.slope @ step + step @ walk.square @ step)
    known = np.isfinite(cost) and np.isfinite(slope).all() and np.isfinite(square).all()
    gained = walk.cost - cost if known else -np.inf
    walk.steps += 1
    small = 0.0 < promised < enough * walk.cost
    if gained > 0.0:
        share = gained / max(promised, 1e-300)
        walk.place, walk.cost = np.clip(walk.place + step, 0.0, 1.0), cost
        walk.slope, walk.square = slope, square
        walk.scale = np.maximum(walk.scale, np.diag(square))
        walk.damping *= max(0.1, 1.0 - (2.0 * min(share, 1.0) - 1.0) ** 3)
        walk.growth = 2.0
        if small and gained < enough * walk.cost:
            walk.reason = f"it has converged, no step lowers the cost by more than {enough:.0e} of it"
    else:
        walk.damping *= walk.growth
        walk.growth *= 2.0
        if small or walk.damping > HOPELESS:
            walk.reason = "it has converged, no step lowers the cost any more"


def _packed(walks: Sequence[_Walk], rounds: int) -> dict[str, np.ndarray]:
    """Where all fits are, as arrays; those of fits with fewer free parameters are filled up with zeros."""
    most = max((len(walk.place) for walk in walks), default=0)

    def filled(value: np.ndarray | float | str) -> np.ndarray:
        one = np.asarray(value)
        return np.pad(one, [(0, most - size) for size in one.shape]) if one.ndim else one

    fields = {
        field.name: np.asarray([filled(getattr(walk, field.name)) for walk in walks]) for field in fields_of(_Walk)
    }
    return {**fields, "rounds": np.asarray(rounds)}


def _unpacked(record: Mapping[str, np.ndarray], lanes: Sequence[Lane]) -> list[_Walk]:
    def cut(value: np.ndarray, size: int) -> Any:
        return value[(slice(size),) * value.ndim] if value.ndim else value.item()

    rows = zip(*(record[field.name] for field in fields_of(_Walk)), strict=True)
    return [
        _Walk(*(cut(np.asarray(one), len(lane.slots)) for one in row)) for lane, row in zip(lanes, rows, strict=True)
    ]


def fit_in_box(
    problem: Problem,
    lanes: Sequence[Lane],
    *,
    outputs: np.ndarray | None = None,
    most: int = MOST_STEPS,
    enough: float = ENOUGH,
    kept: Kept | None = None,
    progress: Progress = quiet,
    what: str = "fitting",
) -> list[Fit]:
    """Fit every lane from its own values.

    A fit ends when a step lowers its cost by less than `enough` of it and promised no more. With `kept`, where every fit
    is is written as it goes, and the same call goes on from there to the same end. `outputs`, (lanes, series, N):
    measured outputs of each lane's own, as in repeated experiments.
    """
    directions = max([len(lane.slots) for lane in lanes], default=1)

    def evaluated(some: Sequence[int], places: Sequence[np.ndarray]) -> list[Equations]:
        found: list[Equations] = []
        for cut in in_parts(problem, len(some), directions):
            part = list(some[cut])
            own = None if outputs is None else outputs[np.asarray(part)]
            found += _normal_equations(problem, [lanes[k] for k in part], places[cut], own)
        return found

    everyone = range(len(lanes))
    kept = kept or Kept()
    key = kept.key((problem, list(lanes)), "fit in box", outputs if outputs is not None else "", most, enough)
    known = kept.load(key)
    if known is not None:
        walks, begun = _unpacked(known, lanes), int(known["rounds"])
    else:
        walks, begun = [], 0
        at = [lane.place for lane in lanes]
        for own, place, (cost, slope, square) in zip(lanes, at, evaluated(everyone, at), strict=True):
            lost = not (np.isfinite(cost) and np.isfinite(slope).all() and np.isfinite(square).all())
            walk = _Walk(place, cost if not lost else np.inf, slope, square, np.diag(square).copy())
            idle = "" if len(own.slots) else "no parameter is free"
            walk.reason = "the model gives no number at the start" if lost else idle
            walks.append(walk)
    for number in range(begun, most):
        kept.save(key, _packed(walks, number), last=False)
        going = [k for k in everyone if not walks[k].reason]
        progress(Stage(what, max(1.0 - len(going) / max(len(lanes), 1), number / most)))
        if not going:
            break
        steps = [_step(walks[k]) for k in going]
        tried = [np.clip(walks[k].place + step, 0.0, 1.0) for k, step in zip(going, steps, strict=True)]
        for k, step, answer in zip(going, steps, evaluated(going, tried), strict=True):
            _judged(walks[k], step, *answer, enough=enough)
    kept.save(key, _packed(walks, most))
    progress(Stage(what, 1.0))
    ended = []
    for lane, walk in zip(lanes, walks, strict=True):
        done = bool(walk.reason) and np.isfinite(walk.cost)
        reason = walk.reason or f"{most} steps were not enough"
        ended.append(Fit(lane.at(walk.place), walk.cost, done, reason, walk.steps))
    return ended
