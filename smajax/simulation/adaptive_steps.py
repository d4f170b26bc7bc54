"""Error-controlled steps: a time with held inputs -> the state at its end.

The scheme of order 3 says what a step may be off by; steps that are off by too much are taken again, shorter. A wire that
heats up alone goes through a tenth of a second at once, and one that has just caught its load takes milliseconds.

Derivatives are those of the steps as they were taken: their lengths are held, for whether one is taken again depends on the
parameters by jumps. By the whole time, that of the last step. In forward mode alone; reverse mode cannot go back through a loop whose length is not known.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from smajax.core.where_tree import where_tree
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.observers import HOTTEST
from smajax.simulation.step import step_and_error

SAFETY = 0.9
SHRINK, GROW = 0.2, 4.0  # of one step to the next
SHORTEST = 1e-3  # share of the whole time, at which a step is taken whatever its error: an impact is not resolved
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


def advance(
    system: System, state: State, inputs: Inputs, dt: Scalar, tried: Scalar, tolerance: Scalar, once: bool = False
) -> tuple[State, Scalar, Scalar]:
    """(state after `dt` seconds with `inputs` held, the step to begin with next time, how many were taken).

    `tried` (s) is the step to begin with. `once`: as in `step.step`.
    """
    shortest = SHORTEST * lax.stop_gradient(dt)

    def unfinished(at: _At) -> Scalar:
        return at.left > 0.0

    def body(at: _At) -> _At:
        last = at.tried >= at.left * (1.0 - 1e-6)
        # Two equal ones in the place of a long and a short one.
        length = jnp.where(last, at.left, lax.stop_gradient(jnp.minimum(at.tried, 0.5 * at.left)))
        new, error = step_and_error(system, at.state, inputs, length, once)
        worst = lax.stop_gradient(_relative(system, error, tolerance))
        # A state that is not finite, or of a wire that has molten, goes to the end at once: no shorter step mends it.
        degrees = at.state.wire.temperature
        lost = ~jnp.isfinite(degrees + at.state.motion.position + at.state.wire.stress) | (degrees > HOTTEST)
        length = jnp.where(lost, at.left, length)
        last = last | lost
        good = (worst <= 1.0) | (length <= shortest) | lost
        # The power 1/4 in the place of 1/3: two square roots are vector instructions, a power is a call a number.
        factor = jnp.clip(SAFETY / jnp.sqrt(jnp.sqrt(jnp.maximum(worst, 1e-6))), SHRINK, GROW)
        proposed = lax.stop_gradient(jnp.maximum(length * factor, shortest))
        # A step cut short by the end of the time says nothing against a longer one.
        following = jnp.where(good & (length < at.tried), jnp.maximum(at.tried, proposed), proposed)
        state = where_tree(good, new, at.state)
        left = jnp.where(good, jnp.where(last, 0.0, at.left - length), at.left)
        return _At(state, left, following, at.taken + 1)

    first = _At(state, dt, lax.stop_gradient(jnp.minimum(tried, dt)), jnp.zeros_like(dt, int))
    end = lax.while_loop(unfinished, body, first)
    return end.state, end.tried, end.taken
