"""Error-controlled steps: a time with held inputs -> the state at its end.

The scheme of order 3 says what a step may be off by; steps that are off by too much are taken again, shorter. A wire that
heats up alone goes through a tenth of a second at once, and one that has just caught its load takes milliseconds.

Derivatives are those of the steps as they were taken: their lengths are held, for whether one is taken again depends on the
parameters by jumps. By the whole time, that of the last step. In forward mode alone; reverse mode cannot go back through a loop whose length is not known.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from smajax.core.where_tree import where_tree
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.observers import went_wrong
from smajax.simulation.step import step_and_error

SAFETY = 0.9
SHRINK, GROW = 0.2, 4.0  # of one step to the next
# A step of this share of the whole time, or of `WHOLE` where that is less, is taken whatever its error: an impact is not resolved. Below a tolerance of
# `RESOLVED` it is shorter in the same proportion, down to `LEAST` of it: a run that others are measured against does not have their error.
SHORTEST, WHOLE = 1e-3, 0.05  # s
RESOLVED, LEAST = 1e-4, 1e-3
# Tries in the whole time, or in each `WHOLE` of it, after which one step goes to its end and counts as a stage that did not converge. Of 3,072 wires from all over the
# declared bounds none needs more than 1,100 at a tolerance of 1e-4, or 6,000 at 1e-8.
MOST_STEPS = 10_000
VELOCITY_TIME = 0.01  # s: an error of velocity counts as what it has moved the load by in this time


class _At(NamedTuple):
    state: State
    left: Scalar  # s
    tried: Scalar  # s, the step to try next
    taken: Scalar


def _relative(system: System, error: tuple[Scalar, Scalar, Scalar], tolerance: Scalar) -> Scalar:
    """The error over what is tolerated: shares of 1 C and of 1 % strain. NaN counts as infinite."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    temperature, position, velocity = error
    moved = jnp.abs(position) + VELOCITY_TIME * jnp.abs(velocity)
    worst = jnp.maximum(jnp.abs(temperature), moved * load.contraction(system.wire) / 0.01) / tolerance
    return jnp.where(jnp.isnan(worst), jnp.inf, worst)


def _outside(state: State) -> Scalar:
    not_finite, runaway = went_wrong(state)
    return not_finite | runaway


def advance(  # of one sample, each once
    system: System,
    state: State,
    inputs: Inputs,
    dt: Scalar,
    tried: Scalar,
    tolerance: Scalar,
    once: bool = False,
    most: Scalar | None = None,
) -> tuple[State, Scalar, Scalar]:
    """(state after `dt` seconds with `inputs` held, the step to begin with next time, how many were taken).

    `tried` (s) is the step to begin with. `once`: as in `step.step`. `most`: tries, where that is less than `MOST_STEPS`. A part that is not resolved, because a state in it cannot be or the tries
    ran out (`MOST_STEPS`), counts in the state's `unsolved`.
    """
    finer = jnp.clip(lax.stop_gradient(tolerance) / RESOLVED, LEAST, 1.0)
    shortest = SHORTEST * finer * jnp.minimum(lax.stop_gradient(dt), WHOLE)
    allowed = MOST_STEPS * jnp.maximum(lax.stop_gradient(dt) / WHOLE, 1.0)
    allowed = allowed if most is None else jnp.minimum(most, allowed)

    def unfinished(at: _At) -> Scalar:
        return at.left > 0.0

    def body(at: _At) -> _At:
        # A state that is not finite, or of a wire that has molten or is colder than can be, goes to the end at once: no shorter step mends it.
        outside, exhausted = _outside(at.state), at.taken >= allowed
        lost = outside | exhausted
        last = (at.tried >= at.left * (1.0 - 1e-6)) | lost
        # Two equal ones in the place of a long and a short one.
        length = jnp.where(last, at.left, lax.stop_gradient(jnp.minimum(at.tried, 0.5 * at.left)))
        new, error = step_and_error(system, at.state, inputs, length, once)
        worst = lax.stop_gradient(_relative(system, error, tolerance))
        # A step to the end may be longer than the one that was tried, by rounding: it is the shortest one all the same.
        good = (worst <= 1.0) | (jnp.minimum(length, at.tried) <= shortest) | lost
        # The power 1/4 in the place of 1/3: two square roots are vector instructions, a power is a call a number.
        factor = jnp.clip(SAFETY / jnp.sqrt(jnp.sqrt(jnp.maximum(worst, 1e-6))), SHRINK, GROW)
        proposed = lax.stop_gradient(jnp.maximum(length * factor, shortest))
        # A step cut short by the end of the time says nothing against a longer one.
        following = jnp.where(good & (length < at.tried), jnp.maximum(at.tried, proposed), proposed)
        # One that is back within the range at the end would show nothing of it.
        hidden = exhausted | (outside & ~_outside(new))
        new = dataclasses.replace(new, unsolved=new.unsolved + jnp.where(hidden, 1.0, 0.0))
        state = where_tree(good, new, at.state)
        left = jnp.where(good, jnp.where(last, 0.0, at.left - length), at.left)
        return _At(state, left, following, at.taken + 1)

    first = _At(state, dt, lax.stop_gradient(jnp.minimum(tried, dt)), jnp.zeros_like(dt, int))
    end = lax.while_loop(unfinished, body, first)
    return end.state, end.tried, end.taken
