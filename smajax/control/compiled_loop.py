"""One closed loop as machine code: for a call by itself, outside of `jit`, `vmap` and `grad`."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.figures_of_merit import Merit, merit
from smajax.control.measured_state import Sensor
from smajax.control.reference import Reference
from smajax.engine import Engine
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.simulation.compiled import alone
from smajax.simulation.simulate import DEFAULT_STEP


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
    engine: Engine = "auto",
) -> tuple[ClosedLoop, Merit]:
    """`simulate_closed_loop` and `merit` of it, arrays of numpy.

    Arguments and errors as there, for `wanted` as a `Reference`; `engine` as `simulate_compiled`'s.
    """
    asked = _AskedLoop(
        system, controller, wanted, jnp.asarray(dt, dtype=float), estimator, sensor, key, every=every, delay=delay
    )
    loop, found = alone(_judged_run, asked, engine)
    return loop, found
