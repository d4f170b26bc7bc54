"""The source's rigs (`smajax.model.rigs`) simulated: compiled once for all rows of a rig, results in numpy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.model.system import System
from smajax.model.types import Series, Trajectory
from smajax.simulation.compiled import run_alone
from smajax.simulation.simulate import simulate

Batched = Float[Array, "runs time"]
# A Trajectory (or a ClosedLoop of one) whose arrays are numpy's, which the type of a jax array does not say.
Recorded = Any

LAWS = ("tanaka", "liang", "brinson", "enhanced")


def recorded(run: Trajectory | ClosedLoop) -> Recorded:
    """The same record in numpy, for checks and pictures."""
    return jax.tree.map(np.asarray, run)


def compiled(function: Callable[..., Any]) -> Callable[..., Recorded]:
    """`function` as machine code, in tenths of a second where XLA takes ten; in numpy. What is no array is part of the program."""

    def applied(given: tuple[Any, ...], _: dict[str, Any]) -> Any:
        return function(*given)

    def run(*given: Any) -> Recorded:
        return run_alone(applied, given, "auto")

    return run


def together(runs: Sequence[Any]) -> Recorded:
    """One record of arrays (runs, ...) of many."""
    return jax.tree.map(lambda *leaves: np.stack(leaves), *runs)


_simulated = compiled(simulate)


def simulated(system: System, inputs: dict[str, Series], dt: float) -> Recorded:
    """One run, compiled, in numpy."""
    return _simulated(system, inputs, dt)


def batch(system: System, inputs: dict[str, Batched], dt: float) -> Recorded:
    """Many runs of one system: every input, and every array that comes back, of shape (runs, time)."""
    series = {name: np.asarray(values) for name, values in inputs.items()}
    count = len(next(iter(series.values())))
    return together([simulated(system, {name: of[k] for name, of in series.items()}, dt) for k in range(count)])


_controlled = compiled(simulate_closed_loop)


def controlled(
    system: System,
    target: Series,
    dt: float,
    period: float,
    make: Callable[[System], AbstractController],
) -> Recorded:
    """The arm under a controller made for it, compiled, in numpy."""
    return _controlled(system, make(system), target, dt, round(period / dt))


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
