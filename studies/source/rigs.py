"""The source's rigs (`smajax.model.rigs`) simulated: compiled once for all rows of a rig, results in numpy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.presets import stress_sliding
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.simulation.simulate import simulate

Batched = Float[Array, "runs time"]
# A Trajectory (or a ClosedLoop of one) whose arrays are numpy's, which the type of a jax array does not say.
Recorded = Any

LAWS = ("tanaka", "liang", "brinson", "enhanced")


def recorded(run: Trajectory | ClosedLoop) -> Recorded:
    """The same record in numpy, for checks and pictures."""
    return jax.tree.map(np.asarray, run)


@eqx.filter_jit
def _simulated(system: System, inputs: dict[str, Series], dt: float) -> Trajectory:
    return simulate(system, inputs, dt)


def simulated(system: System, inputs: dict[str, Series], dt: float) -> Recorded:
    """One run, compiled, in numpy."""
    return recorded(_simulated(system, inputs, dt))


@eqx.filter_jit
def _batch(system: System, inputs: dict[str, Batched], dt: float) -> Trajectory:
    return jax.vmap(lambda one: simulate(system, one, dt))(inputs)


def batch(system: System, inputs: dict[str, Batched], dt: float) -> Recorded:
    """Many runs of one system at once: every input, and every array that comes back, of shape (runs, time)."""
    return recorded(_batch(system, inputs, dt))


@eqx.filter_jit
def _controlled(system: System, controller: AbstractController, target: Series, dt: float, every: int) -> ClosedLoop:
    return simulate_closed_loop(system, controller, target, dt, every)


def controlled(
    system: System,
    target: Series,
    dt: float,
    period: float,
    make: Callable[[System], AbstractController] = stress_sliding,
) -> Recorded:
    """The arm under stress-based sliding control, with the gains of a preset, compiled, in numpy."""
    return recorded(_controlled(system, make(system), target, dt, round(period / dt)))


def austenite_range(system: System, stress: Any) -> tuple[Any, Any]:
    """(A_s', A_f') at a stress, C: the range moved by sigma/C_A."""
    law = system.wire.kinetics
    shift = stress / float(law.stress_slope_austenite)
    return float(law.austenite_start) + shift, float(law.austenite_finish) + shift


def martensite_range(system: System, stress: Any) -> tuple[Any, Any]:
    """(M_s', M_f') at a stress, C."""
    law = system.wire.kinetics
    shift = stress / float(law.stress_slope_martensite)
    return float(law.martensite_start) + shift, float(law.martensite_finish) + shift
