"""Observers of a run (`integrate`): traces of its states, measures, and whether it went wrong.

They record and are no state estimators, which are in `smajax.control.estimators`.
"""

from __future__ import annotations

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.integrate import AbstractObserver, Observed, Period, Step, with_first
from smajax.simulation.measures import AbstractMeasure, value_of

# Status codes of a run. `IMPOSSIBLE`: its parameters are out of their bounds or in the wrong order; only a batch, which knows its values, gives it.
GOOD, NOT_FINITE, RUNAWAY, UNSOLVED, IMPOSSIBLE = 0, 1, 2, 3, 4
HOTTEST = 3000.0  # C: no wire is hotter, it has molten long before
COLDEST = -273.15  # C


class StateTrace(AbstractObserver):
    """Every state: a pytree with leaves of shape (steps + 1, ...)."""

    def sample(self, now: Step) -> Any:
        return now.after

    def result(self, run: Observed) -> Any:
        return with_first(run.start, run.samples)


class ValueTrace(AbstractObserver):
    """Named values (`measures.SHOWN`) at the start and after every period: name -> (periods + 1,)."""

    per_period: ClassVar[bool] = True

    names: tuple[str, ...] = eqx.field(static=True)

    def sample(self, now: Period) -> dict[str, Scalar]:
        return {name: value_of(now.after, name) for name in self.names}

    def result(self, run: Observed) -> dict[str, jax.Array]:
        return {name: jnp.append(value_of(run.start, name), run.samples[name]) for name in self.names}


class Measures(AbstractObserver):
    """Measures of a run by name."""

    measures: tuple[AbstractMeasure, ...]
    dt: Scalar  # s
    constants: dict[str, Scalar]  # inputs that do not change, by channel
    first: Inputs  # all inputs at the start

    def init(self, state: State) -> list[Any]:
        return [one.start(state, self.first) for one in self.measures]

    def update(self, memory: list[Any], step: Step) -> list[Any]:
        inputs = {**self.constants, **step.inputs}
        return [one.update(its, step.after, inputs, self.dt) for one, its in zip(self.measures, memory, strict=True)]

    def result(self, run: Observed) -> dict[str, Scalar]:
        return {one.name: one.result(its) for one, its in zip(self.measures, run.memory, strict=True)}


class Status(AbstractObserver):
    """`status` (a code) and `first_bad_time` (s; infinite where nothing went wrong).

    A run with a stage that did not converge (`UNSOLVED`) goes on, and may go wrong in another way, which counts for more.
    """

    def init(self, state: State) -> tuple[Scalar, Scalar, Scalar]:
        never = jnp.full_like(state.time, jnp.inf)
        return never, jnp.zeros_like(state.time, int), never

    def update(self, memory: tuple[Scalar, Scalar, Scalar], step: Step) -> tuple[Scalar, Scalar, Scalar]:
        first, status, unsolved = memory
        state: State = step.after
        not_finite, runaway = went_wrong(state)
        code = jnp.where(not_finite, NOT_FINITE, jnp.where(runaway, RUNAWAY, GOOD))
        fresh = (status == GOOD) & (code != GOOD)
        unsolved = jnp.where((unsolved == jnp.inf) & (state.unsolved > 0.0), state.time, unsolved)
        return jnp.where(fresh, state.time, first), jnp.where(fresh, code, status), unsolved

    def result(self, run: Observed) -> dict[str, Scalar]:
        first, status, unsolved = run.memory
        alone = (status == GOOD) & (unsolved < jnp.inf)
        status, first = jnp.where(alone, UNSOLVED, status), jnp.where(alone, unsolved, first)
        return {"status": status.astype("int8"), "first_bad_time": first}


def went_wrong(state: State) -> tuple[Scalar, Scalar]:
    """Of one state: (not finite, runaway)."""
    wire, motion = state.wire, state.motion
    total = wire.temperature + wire.stress + wire.martensite_fraction + motion.position + motion.velocity
    return ~jnp.isfinite(total), (wire.temperature > HOTTEST) | (wire.temperature < COLDEST)
