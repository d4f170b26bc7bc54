"""Automatic derivatives of a simulated run against differences: shared by the tests of gradients."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager

import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import get_parameters, parameters, set_vector
from smajax.model.system import System
from smajax.simulation import stage_solver, step
from smajax.simulation.simulate import simulate

Features = Callable[[System], jax.Array]


def open_loop(inputs: dict[str, jax.Array], dt: float) -> Features:
    """Means of the reading and the temperature over parts of a run.

    Smooth in time, so that a kink of one sample does not hide the derivative; several, so that none is blind.
    """

    def features(system: System) -> jax.Array:
        run = simulate(system, inputs, dt)
        return jnp.stack(
            [run.reading.mean(), run.reading[150:].mean(), run.reading[-100:].mean(), run.temperature.mean()]
        )

    return features


@contextmanager
def _solved_to_the_end() -> Iterator[None]:
    """Stages of which an iteration leaves nothing: a difference over 1e-6 would see what it leaves otherwise."""
    usual, close = step.ORDER_TWO, stage_solver.CLOSE
    step.ORDER_TWO, stage_solver.CLOSE = usual._replace(enough=1e-12), 1e-15
    try:
        yield
    finally:
        step.ORDER_TWO, stage_solver.CLOSE = usual, close


def compare(system: System, of: Features, skipped: Container[str] = ()) -> None:
    """Forward-mode derivatives of `of` by every parameter equal central differences to 1e-4 of their size."""
    names = list(parameters(system))
    at = get_parameters(system, names)

    def features(vector: jax.Array) -> jax.Array:
        return of(set_vector(system, names, vector))

    forward = np.asarray(jax.jit(jax.jacfwd(features))(at))
    with _solved_to_the_end():
        evaluate = jax.jit(features).lower(at).compile()
    table = parameters(system)
    for index, name in enumerate(names):
        if name in skipped:
            continue
        value, room = float(at[index]), table[name].high - table[name].low
        change = 1e-6 * (abs(value) or 1e-2 * room)
        if "." in name and abs(value) < 1e-2 * room:
            # A coefficient next to nothing: wide enough to rise above rounding, and not across zero.
            change = min(1e-5 * room, 0.1 * abs(value) or 1e-5 * room)
        # On a bound (a wire that starts as martensite) the difference is one-sided, of second order.
        inward = 1.0 if value - change < table[name].low else -1.0 if value + change > table[name].high else 0.0
        if inward:
            change = 1e-5 * room
            points = [evaluate(at.at[index].set(value + inward * k * change)) for k in (0, 1, 2)]
            difference = np.asarray((-3 * points[0] + 4 * points[1] - points[2]) / (2 * inward * change))
        else:
            difference = np.asarray(
                (evaluate(at.at[index].set(value + change)) - evaluate(at.at[index].set(value - change))) / (2 * change)
            )
        rounding = 1e-13 * np.abs(np.asarray(evaluate(at))).max() / change
        scale = np.abs(difference).max() * 1e-4 + rounding
        error = np.abs(forward[:, index] - difference).max()
        assert error <= scale, f"{name}: automatic {forward[:, index]}, differences {difference}"
