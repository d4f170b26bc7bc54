"""Moves from one set point to the next, which no tuning looks at: a wire that is hot and half transformed is another plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup
from smajax.control.compiled_loop import evaluated_loop_compiled
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import SetPointMerit, merit_by_set_point
from smajax.control.reference import clock, resting
from smajax.control.tune.evaluate import FINE, STEP, TuningProblem

MOST = 12  # set points of a walk


@dataclass(frozen=True)
class Moves:
    """A walk over the set points on the plant as believed, up and down by turns: a row a move, figures in degrees (millimetres) and seconds.

    settling_time is infinite where the next set point was asked before the angle had come to rest.
    """

    asked: np.ndarray  # (moves + 1,), degrees or millimetres; the first one is begun from the start and not judged
    overshoot: np.ndarray  # (2, moves), before and after
    settling_time: np.ndarray  # (2, moves), s
    steady_error: np.ndarray  # (2, moves)


def walk(set_points: Sequence[float]) -> list[float]:
    """The set points in an order of long moves up and down: least, greatest, second least, ..."""
    ordered = sorted(set_points)
    if len(ordered) > MOST:
        ordered = [ordered[k] for k in np.linspace(0, len(ordered) - 1, MOST).round().astype(int)]
    result: list[float] = []
    while ordered:
        result.append(ordered.pop(0))
        if ordered:
            result.append(ordered.pop())
    return result


def moved(rig: TuningProblem, pair: Sequence[AbstractController], set_points: Sequence[float]) -> Moves | None:
    """`pair`: controllers with the gains before and after. None of a single set point: there is no move."""
    asked = walk(set_points)
    if len(asked) < 2:
        return None
    unit = rig.plants.unit
    time = np.asarray(clock(rig.seconds * len(asked), FINE))
    which = np.minimum((time / rig.seconds + 1e-9).astype(int), len(asked) - 1)
    wanted = resting(jnp.asarray(unit.to_own(asked)[which]))
    several: list[tuple[SetPointMerit, ...]] = []
    for controller in pair:
        setup = ClosedLoopSetup(
            rig.system,
            controller,
            wanted,
            FINE,
            rig.interface.every * round(STEP / FINE),
            estimator=rig.interface.estimator,
            sensor=rig.interface.sensor,
            key=None if rig.interface.sensor is None else jax.random.key(rig.seed),
            delay=rig.interface.delay,
            integration=rig.integration,
        )
        ran, _ = evaluated_loop_compiled(setup)
        several.append(merit_by_set_point(ran, rig.system)[1:])

    def of(name: str) -> np.ndarray:
        return np.asarray([[float(getattr(one.merit, name)) for one in rests] for rests in several])

    return Moves(np.asarray(asked), unit.of(of("overshoot")), of("settling_time"), unit.of(of("steady_error")))
