"""A system under a sampled controller -> a trajectory. `jit`, `vmap` and `grad` stay outside, as in `simulate`."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.controller.base import AbstractController
from smajax.simulate import DEFAULT_STEP, trajectory
from smajax.step import step
from smajax.system import System, initial_state
from smajax.types import Scalar, Series, State, Trajectory


class ClosedLoop(eqx.Module):
    """A controlled run: the states at t_0 ... t_{n-1}, and the command from each of them on, arrays of shape (n,)."""

    run: Trajectory
    target: Series
    inputs: dict[str, Series]


def simulate_closed_loop(
    system: System,
    controller: AbstractController,
    target: Series,
    dt: Scalar | float = DEFAULT_STEP,
    every: int = 1,
    at_rest: dict[str, Scalar] | None = None,
) -> ClosedLoop:
    """Simulate over the samples of `target` (rad or m), `dt` seconds apart; the controller is called `every` samples.

    Its command is held in between, as a digital controller holds it. It sees the true state; an estimator gives it
    another one. `at_rest` are the inputs in which the system rests at the start (default: zero voltage). Raises
    ValueError when `target` has not a whole number of control periods and one sample more.
    """
    count = jnp.shape(target)[0]
    if every < 1 or (count - 1) % every:
        raise ValueError(
            f"`target` has {count} samples and the controller is called every {every}: give a multiple of {every} and "
            "one sample more, so that the run ends with a whole control period."
        )
    target = jnp.asarray(target, dtype=float)
    period = jnp.asarray(dt, dtype=float) * every
    resting = {"voltage": jnp.zeros(())} if at_rest is None else at_rest
    state = initial_state(system, resting)

    def period_of(carry: tuple[State, Any], wanted: Scalar) -> tuple[tuple[State, Any], Any]:
        state, memory = carry
        inputs, memory = controller.command(memory, state, wanted, period)

        def body(state: State, _: None) -> tuple[State, State]:
            new = step(system, state, inputs, dt)
            return new, new

        state, states = lax.scan(body, state, None, length=every)
        return (state, memory), (states, inputs)

    start = state, controller.start(state, target[0])
    _, (states, inputs) = lax.scan(period_of, start, target[:-1:every])
    states = jax.tree.map(lambda rest: rest.reshape(-1, *rest.shape[2:]), states)
    held = {name: jnp.repeat(values, every) for name, values in inputs.items()}
    held = {name: jnp.append(values, values[-1]) for name, values in held.items()}
    return ClosedLoop(trajectory(state, states), target, held)
