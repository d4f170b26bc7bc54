"""One run as machine code: for a call by itself, outside of `jit`, `vmap` and `grad`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import check_bounds
from smajax.engine import Engine, Wanted, begin_programs, program
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.simulation.input_delay import acting_inputs
from smajax.simulation.integration_error import (
    AUTO,
    IntegrationError,
    Outputs,
    Tolerance,
    alone,
    coarse_to_fine,
    integrated,
)
from smajax.simulation.measures import SHOWN
from smajax.simulation.sensors import SENSORS, sensor_output
from smajax.simulation.simulate import (
    DEFAULT_STEP,
    check_inputs,
    check_kinds,
    check_scalars,
    first_state,
    simulate,
    trajectory_of,
    warn_of_unsolved,
)
from smajax.simulation.steppers import Integration, stepper_of


class _Request(eqx.Module):
    system: System
    inputs: dict[str, Series]
    dt: Scalar
    integration: Integration
    initial: State | None


def _run(request: _Request, _: dict[str, Scalar]) -> Trajectory:
    series = acting_inputs(request.system, request.inputs, request.dt)
    stepper = stepper_of(request.system, request.dt, request.integration)
    return trajectory_of(stepper, series, first_state(request.system, series, request.initial))


def simulate_compiled(
    system: System,
    inputs: Mapping[str, Series],
    dt: float = DEFAULT_STEP,
    tolerance: float | None = None,
    initial: State | None = None,
    engine: Engine = "auto",
) -> Trajectory:
    """What `simulate` gives, arrays of numpy, compiled in half of the time and run in a tenth of it.

    `inputs` have shape (n,), SI, `dt` seconds apart, and hold from sample to sample. With a `tolerance` (shares of 1 C
    and of 1 % strain a step; 1e-4 is good) a moving load takes as many steps between two samples as its error asks for.
    Compiled once for runs of one length and kind of model, whatever its values. Raises ValueError as `simulate` does,
    and for a tolerance that is none; TypeError within `grad`, `jit` and `vmap`. `engine`: "auto" is machine code, or XLA with a
    warning (`EngineWarning`) where that cannot be had; "native" raises what stands in the way, "xla" does not try.
    """
    check_kinds(system, inputs)
    if any(
        isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((system, dict(inputs), dt, tolerance, initial))
    ):
        raise TypeError(
            "simulate_compiled() is machine code, and no gradient, jit or vmap goes through it: use `smajax.simulation.simulate.simulate`, "
            "which gives the same."
        )
    check_inputs(system, inputs)
    check_scalars(system, dt, initial)
    check_bounds(system)
    check_tolerance(system, tolerance)
    integration = Integration(None if tolerance is None else jnp.asarray(tolerance))
    run = compiled_run(system, inputs, dt, integration, initial, engine)
    warn_of_unsolved(run)
    return run


def check_tolerance(system: System, tolerance: Tolerance) -> None:
    """ValueError for a tolerance that is none, or of a load that does not move."""
    if tolerance is None or tolerance == AUTO:
        return
    given: Any = tolerance  # a text too, of whoever does not check types
    if isinstance(given, str) or not given > 0.0 or not isinstance(system.load, AbstractMovingLoad):
        raise ValueError(
            f"`tolerance` is a positive number, a share of 1 C and of 1 % strain a step, for a load that moves; got {tolerance} and "
            f'{type(system.load).__name__}. Take 1e-4, "auto" where the error is to choose, or None for one step a sample.'
        )


def measured_run(
    system: System,
    inputs: Mapping[str, Series],
    dt: float = DEFAULT_STEP,
    tolerance: Tolerance = AUTO,
    initial: State | None = None,
    engine: Engine = "auto",
) -> tuple[Trajectory, IntegrationError]:
    """A run, and what its integration leaves in the states and sensors.

    With "auto" that is less than 3e-4 of a whole transformation where any tolerance comes so far; a number is taken as it is, and None
    is one step a sample, of which nothing is measured. Raises as `simulate_compiled`.
    """
    _, error, found = _measured(system, inputs, dt, tolerance, alone(system), initial, engine)
    return found, error


def chosen_integration(
    system: System, inputs: Mapping[str, Series], dt: float, reverse: bool = False
) -> tuple[Integration, IntegrationError]:
    """The cheapest `integration` for `simulate` of such runs that leaves little in them, and its error: chosen outside of `jit`, fixed inside.

    `reverse`: one that `jax.grad` goes back through, of equal steps. Raises as `simulate_compiled`.
    """
    integration, error, _ = _measured(system, inputs, dt, AUTO, coarse_to_fine(system, reverse), None, "auto")
    return integration, error


def _measured(  # as `measured_run`, of which it is the work, with the choices
    system: System,
    inputs: Mapping[str, Series],
    dt: float,
    tolerance: Tolerance,
    choices: Iterator[Integration],
    initial: State | None,
    engine: Engine,
) -> tuple[Integration, IntegrationError, Trajectory]:
    check_inputs(system, inputs)
    check_scalars(system, dt, initial)
    check_bounds(system)
    check_tolerance(system, tolerance)

    def run(integration: Integration) -> tuple[Trajectory, Outputs]:
        found = compiled_run(system, inputs, dt, integration, initial, engine)
        outputs = {name: np.asarray(getattr(found, name))[None] for name in SHOWN}
        return found, outputs | {name: np.asarray(sensor_output(system, found, name))[None] for name in SENSORS}

    return integrated(run, system, tolerance, choices)


def compiled_run(
    system: System,
    inputs: Mapping[str, Series],
    dt: float,
    integration: Integration,
    initial: State | None = None,
    engine: Engine = "auto",
) -> Trajectory:
    """`simulate_compiled` without its checks, integrated as `integration` says."""
    series = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}
    if len(next(iter(series.values()))) == 1:  # the start alone: there is nothing to compile
        return jax.tree.map(np.asarray, simulate(system, series, dt, initial))
    return run_alone(_run, _Request(system, series, jnp.asarray(dt, dtype=float), integration, initial), engine)


def begin_compiled_run(
    system: System, inputs: Mapping[str, Series], dt: float, integration: Integration, initial: State | None = None
) -> None:
    """Have a second process, where there is one, make the program of `compiled_run` with these arguments."""
    series = {name: jnp.asarray(values, dtype=float) for name, values in inputs.items()}
    if len(next(iter(series.values()))) == 1:
        return
    request = _Request(system, series, jnp.asarray(dt, dtype=float), integration, initial)
    begin_programs([_alone(_run, request)])


def _alone(function: Callable[..., Any], model: eqx.Module) -> Wanted:
    return Wanted(function, model, ("number",), alone=True)


def run_alone(function: Callable[..., Any], model: eqx.Module, engine: Engine) -> Any:
    """What `function(model, _)` gives of one run, arrays of numpy."""
    run = program(**_alone(function, model)._asdict(), engine=engine)
    return jax.tree.map(lambda leaf: leaf[0], run(model, {"number": np.zeros(1)}, threads=1))
