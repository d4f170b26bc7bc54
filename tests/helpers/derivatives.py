"""Automatic derivatives of a simulated run against differences: shared by the tests of gradients."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import Parameter, get_parameters, parameters, set_vector
from smajax.engine import Engine, program
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


def _vector(own: dict[str, jax.Array], kind: str) -> jax.Array:
    return jnp.stack([value for name, value in own.items() if name.startswith(kind)])


def compare(system: System, of: Features, skipped: Container[str] = (), engine: Engine = "native") -> None:
    """Forward-mode derivatives of `of` by every parameter equal central differences to 1e-4 of their size.

    By machine code, which compiles in a tenth of the time, unless `engine` is "xla".
    """
    table = parameters(system)
    names, at = list(table), np.asarray(get_parameters(system, list(table)))

    def features(values: jax.Array, system: System) -> jax.Array:
        return of(set_vector(system, names, values))

    def slope(system: System, own: dict[str, jax.Array]) -> jax.Array:
        at, along = _vector(own, "value"), _vector(own, "along")
        return jax.jvp(lambda values: features(values, system), (at,), (along,))[1]

    def value(system: System, own: dict[str, jax.Array]) -> jax.Array:
        return features(_vector(own, "value"), system)

    def columns(kind: str, rows: np.ndarray) -> dict[str, np.ndarray]:
        return {f"{kind} {name}": column for name, column in zip(names, rows.T, strict=True)}

    points = np.tile(at, (len(at), 1))
    own = columns("value", points) | columns("along", np.eye(len(at)))
    forward = program(slope, system, tuple(own), engine=engine)(system, own, 1)
    stencils = [_stencil(float(at[k]), table[name]) for k, name in enumerate(names)]
    rows = np.concatenate([at[None], *(at + np.outer(one.moves, np.eye(len(at))[k]) for k, one in enumerate(stencils))])
    own = columns("value", rows)
    with _solved_to_the_end():
        found = program(value, system, tuple(own), engine=engine)(system, own, 1)
    here, parts = found[0], found[1:].reshape(len(at), 3, -1)
    for name, one, automatic, around in zip(names, stencils, forward, parts, strict=True):
        if name in skipped:
            continue
        difference = one.weights @ around
        rounding = 1e-13 * np.abs(here).max() / one.change
        error = np.abs(automatic - difference).max()
        assert error <= np.abs(difference).max() * 1e-4 + rounding, (
            f"{name}: automatic {automatic}, differences {difference}"
        )


class _Stencil(NamedTuple):
    """A difference of second order over three points."""

    change: float
    moves: np.ndarray  # (3,), from the value
    weights: np.ndarray  # (3,)


def _stencil(value: float, entry: Parameter) -> _Stencil:
    room = entry.high - entry.low
    change = 1e-6 * (abs(value) or 1e-2 * room)
    if "." in entry.name and abs(value) < 1e-2 * room:
        # A coefficient next to nothing: wide enough to rise above rounding, and not across zero.
        change = min(1e-5 * room, 0.1 * abs(value) or 1e-5 * room)
    # On a bound (a wire that starts as martensite) the difference is one-sided.
    inward = 1.0 if value - change < entry.low else -1.0 if value + change > entry.high else 0.0
    if inward:
        change = 1e-5 * room
        return _Stencil(change, inward * change * np.arange(3.0), np.array([-3.0, 4.0, -1.0]) / (2.0 * inward * change))
    return _Stencil(change, change * np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 0.0, 1.0]) / (2.0 * change))
