"""Many closed loops on perturbed plants in one program, `CHUNK` at a time side by side.

A mismatch multiplies one parameter of the plant; the controller keeps its gains and the parameters that it assumes. The
air's temperature is multiplied in degrees Celsius: 20 C becomes 10 to 40 C.
"""

from __future__ import annotations

import dataclasses
from contextlib import closing
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import numpy as np

from smajax.control.closed_loop import ClosedLoopSetup, stored_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import Merit, evaluated_loop
from smajax.control.least_time import Largest
from smajax.control.perturbed_plant import OF_ARM, Perturbation, perturbed_plant
from smajax.control.reference import clock, constant
from smajax.control.signal_path import Interface
from smajax.core.parameters import get_parameters, set_vector
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.system import System
from smajax.model.types import Scalar, Series
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.chunks import Function, chunks
from smajax.simulation.integration_error import (
    IntegrationError,
    Outputs,
    Tolerance,
    coarse_to_fine,
    integrated,
)
from smajax.simulation.steppers import ONE_STEP, Integration

# Names of a batch's axes, beside the columns of a `Perturbation`.
TARGET, GAIN, NUMBER = "set point", "share of the gain", "number"
CHUNK = 1024  # loops between two reports of progress
MEASURED = 16  # loops on which the error of the integration is measured
SMALL = 1e-3  # of a whole transformation: a tenth of the degree within which an angle counts as there
IDEAL_INTERFACE = Interface()  # the true state, at every step, without delay


@dataclass(frozen=True)
class LoopSetup:
    """What all loops of a batch have in common. Each loop draws its own noise, from `seed`."""

    system: System  # the plant before it is perturbed
    controller: AbstractController
    main_gain: str  # the gain that the last column of the rows multiplies
    seconds: float = 10.0
    dt: float = 0.01  # s
    interface: Interface = IDEAL_INTERFACE
    seed: int = 0
    integration: Integration = ONE_STEP  # how finely between two samples
    perturbation: Perturbation = OF_ARM  # what the first columns of the rows change of the plant


class Outcome(NamedTuple):
    """Results of closed loops: arrays of shape (L,)."""

    merits: Merit
    failed_at: np.ndarray  # s; infinity where the controller's output was always finite


class _Setup(eqx.Module):
    """`LoopSetup` as a pytree."""

    system: System
    controller: AbstractController
    time: Series
    interface: Interface
    key: jax.Array
    integration: Integration
    main_gain: str = eqx.field(static=True)
    perturbation: Perturbation = eqx.field(static=True)


def _loop(setup: _Setup, values: dict[str, Scalar]) -> ClosedLoopSetup:
    """One closed loop."""
    gain = get_parameters(setup.controller, [setup.main_gain]) * values[GAIN]
    interface = setup.interface.settings(setup.time[1] - setup.time[0], setup.key, values[NUMBER])
    controller = set_vector(setup.controller, [setup.main_gain], gain)
    plant = perturbed_plant(setup.system, values, setup.perturbation)
    wanted = constant(setup.time, values[TARGET])
    return ClosedLoopSetup(plant, controller, wanted, integration=setup.integration, assumed=setup.system, **interface)


def _merits(setup: _Setup, values: dict[str, Scalar]) -> dict[str, Any]:
    merits, failed_at = evaluated_loop(_loop(setup, values))
    return {"merits": merits, "failed_at": failed_at}


def _position(setup: _Setup, values: dict[str, Scalar]) -> dict[str, Any]:
    return {"position": stored_loop(_loop(setup, values)).run.position}


def _run(
    function: Function, setup: LoopSetup, rows: np.ndarray, progress: Progress, numbers: np.ndarray | None = None
) -> Any:
    time, key = clock(setup.seconds, setup.dt), jax.random.key(setup.seed)
    fixed = (setup.main_gain, setup.perturbation)
    common = _Setup(setup.system, setup.controller, time, setup.interface, key, setup.integration, *fixed)
    columns = dict(zip((*setup.perturbation.columns, TARGET, GAIN), rows.T, strict=True))
    axes = zipped({**columns, NUMBER: np.arange(len(rows)) if numbers is None else numbers})
    count = -(-len(rows) // CHUNK)
    results = []
    with closing(chunks(function, common, axes, min(CHUNK, len(rows)), range(count))) as coming:
        for number, result in coming:
            results.append(result)
            progress(Stage("sweeping", (number + 1) / count))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *results)


def closed_loops(
    setup: LoopSetup, rows: np.ndarray, progress: Progress = quiet, numbers: np.ndarray | None = None
) -> Outcome:
    """Run every row of `grid.loop_rows`, on all devices; trajectories are not stored. numbers: (L,), of each loop, by which it draws its noise; its place, by default."""
    whole = _run(_merits, setup, rows, progress, numbers)
    return Outcome(whole["merits"], whole["failed_at"])


def least_times(setup: LoopSetup, rows: np.ndarray, largest_command: float) -> np.ndarray:
    """Least times to the set points of the rows on their plants under that command, s, (L,): no gain, filter, noise or delay has a part in them.

    Infinite where the plant is not there within the length of a loop; see `least_time`.
    """
    plant_alone = dataclasses.replace(
        setup, controller=Largest(largest_command), main_gain="largest_voltage", interface=IDEAL_INTERFACE
    )
    at_its_gain = np.concatenate([rows[:, :-1], np.ones((len(rows), 1))], axis=1)
    return np.asarray(closed_loops(plant_alone, at_its_gain).merits.reach_time)


def positions(setup: LoopSetup, rows: np.ndarray) -> np.ndarray:
    """Positions over time of every row of `grid.loop_rows`, (L, time), rad or m: for the few that are drawn."""
    return _run(_position, setup, rows, quiet)["position"]


def integrated_setup(setup: LoopSetup, rows: np.ndarray, tolerance: Tolerance) -> tuple[LoopSetup, IntegrationError]:
    """(the setup with the integration that `tolerance` asks for, what that leaves in the positions): of some of the rows."""
    some = rows[np.unique(np.linspace(0, len(rows) - 1, MEASURED).astype(int))]

    def run(integration: Integration) -> tuple[None, Outputs]:
        if tolerance is None:
            return None, {}
        return None, {"position": positions(dataclasses.replace(setup, integration=integration), some)}

    integration, error, _ = integrated(run, setup.system, tolerance, coarse_to_fine(setup.system), limit=SMALL)
    return dataclasses.replace(setup, integration=integration), error
