"""One run, open or closed loop, as machine code: for a call by itself, outside of `jit`, `vmap` and `grad`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from smajax.adaptive import advance
from smajax.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.controller.base import AbstractController
from smajax.estimator.base import AbstractEstimator
from smajax.lanes.evaluate import evaluator
from smajax.lanes.text import Unsupported
from smajax.load.base import AbstractMovingLoad
from smajax.measured_state import Sensor
from smajax.merit import Merit, merit
from smajax.parameters import check_bounds
from smajax.recorded import acting_inputs
from smajax.reference import Reference
from smajax.simulate import DEFAULT_STEP, check_inputs, check_kinds, check_scalars, first_state, simulate, trajectory
from smajax.system import System
from smajax.types import Scalar, Series, State, Trajectory


class _Asked(eqx.Module):
    system: System
    inputs: dict[str, Series]
    dt: Scalar
    tolerance: Scalar | None
    initial: State | None


def _run(asked: _Asked, _: dict[str, Scalar]) -> Trajectory:
    system, inputs, dt, tolerance = asked.system, asked.inputs, asked.dt, asked.tolerance
    if tolerance is None:
        return simulate(system, inputs, dt, asked.initial)
    inputs = acting_inputs(system, inputs, dt)
    state = first_state(system, inputs, asked.initial)

    def one(carry: Any, now: dict[str, Scalar]) -> tuple[Any, State]:
        state, tried = carry
        state, tried, _ = advance(system, state, now, dt, tried, tolerance)
        return (state, tried), state

    begin: Any = (state, dt)
    _, states = lax.scan(one, begin, {name: values[:-1] for name, values in inputs.items()})
    return trajectory(state, states)


def simulate_compiled(
    system: System,
    inputs: Mapping[str, Series],
    dt: float = DEFAULT_STEP,
    tolerance: float | None = None,
    initial: State | None = None,
) -> Trajectory:
    """What `simulate` gives, arrays of numpy, compiled in half of the time and run in a tenth of it.

    `inputs` have shape (n,), SI, `dt` seconds apart, and hold from sample to sample. With a `tolerance` (shares of 1 C
    and of 1 % strain a step; 1e-4 is good) a moving load takes as many steps between two samples as its error asks for.
    Compiled once for runs of one length and kind of model, whatever its values. Raises ValueError as `simulate` does,
    and for a tolerance that is none; TypeError within `grad`, `jit` and `vmap`; Unsupported for an effect or a load of your
    own that cannot be translated.
    """
    check_kinds(system, inputs)
    if any(
        isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((system, dict(inputs), dt, tolerance, initial))
    ):
        raise TypeError(
            "simulate_compiled() is machine code, and no gradient, jit or vmap goes through it: use `smajax.simulate.simulate`, "
            "which gives the same."
        )
    check_inputs(system, inputs)
    check_scalars(system, dt, initial)
    check_bounds(system)
    if tolerance is not None and (not tolerance > 0.0 or not isinstance(system.load, AbstractMovingLoad)):
        raise ValueError(f"`tolerance` is a positive number, for a load that moves; got {tolerance}. Take 1e-4.")
    series = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}
    if len(next(iter(series.values()))) == 1:  # the start alone: there is nothing to compile
        return jax.tree.map(np.asarray, simulate(system, series, dt, initial))
    limit = None if tolerance is None else jnp.asarray(tolerance, dtype=float)
    asked = _Asked(system, series, jnp.asarray(dt, dtype=float), limit, initial)
    found = evaluator(_run, asked, ("number",), alone=True)(asked, {"number": np.zeros(1)}, threads=1)
    return jax.tree.map(lambda leaf: leaf[0], found)


class _AskedLoop(eqx.Module):
    system: System
    controller: AbstractController
    wanted: Reference
    dt: Scalar
    estimator: AbstractEstimator | None
    sensor: Sensor | None
    key: jax.Array | None
    every: int = eqx.field(static=True)
    delay: int = eqx.field(static=True)


def _judged_run(asked: _AskedLoop, _: dict[str, Scalar]) -> tuple[ClosedLoop, Merit]:
    loop = simulate_closed_loop(
        asked.system,
        asked.controller,
        asked.wanted,
        asked.dt,
        asked.every,
        estimator=asked.estimator,
        sensor=asked.sensor,
        key=asked.key,
        delay=asked.delay,
    )
    return loop, merit(loop, asked.system)


def judged_loop_compiled(
    system: System,
    controller: AbstractController,
    wanted: Reference,
    dt: float = DEFAULT_STEP,
    every: int = 1,
    *,
    estimator: AbstractEstimator | None = None,
    sensor: Sensor | None = None,
    key: jax.Array | None = None,
    delay: int = 0,
) -> tuple[ClosedLoop, Merit]:
    """`simulate_closed_loop` and `merit` of it, arrays of numpy; by XLA where a part cannot be translated.

    Arguments and errors as there, for `wanted` as a `Reference`.
    """
    asked = _AskedLoop(
        system, controller, wanted, jnp.asarray(dt, dtype=float), estimator, sensor, key, every=every, delay=delay
    )
    try:
        found = evaluator(_judged_run, asked, ("number",), alone=True)(asked, {"number": np.zeros(1)}, threads=1)
    except Unsupported:
        return jax.tree.map(np.asarray, eqx.filter_jit(_judged_run)(asked, {}))
    return jax.tree.map(lambda leaf: leaf[0], found)
