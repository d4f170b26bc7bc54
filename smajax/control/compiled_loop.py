"""One closed loop as machine code: for a call by itself, outside of `jit`, `vmap` and `grad`."""

from __future__ import annotations

import dataclasses

import numpy as np

from smajax.control.closed_loop import ClosedLoop, ClosedLoopSetup, stored_loop
from smajax.control.figures_of_merit import Merit, merit
from smajax.engine import Engine
from smajax.model.types import Scalar
from smajax.simulation.compiled import check_tolerance, run_alone
from smajax.simulation.integration_error import (
    AUTO,
    IntegrationError,
    Outputs,
    Tolerance,
    alone,
    integrated,
)
from smajax.simulation.measures import SHOWN
from smajax.simulation.steppers import Integration


def _run(setup: ClosedLoopSetup, _: dict[str, Scalar]) -> tuple[ClosedLoop, Merit]:
    loop = stored_loop(setup)
    return loop, merit(loop, setup.system, assumed=setup.assumed)


def evaluated_loop_compiled(setup: ClosedLoopSetup, engine: Engine = "auto") -> tuple[ClosedLoop, Merit]:
    """`simulate_closed_loop` and `merit` of it, arrays of numpy. Errors as there; `engine` as `simulate_compiled`'s."""
    return run_alone(_run, setup, engine)


def measured_loop(
    setup: ClosedLoopSetup, tolerance: Tolerance = AUTO, engine: Engine = "auto"
) -> tuple[ClosedLoop, Merit, IntegrationError]:
    """The same, integrated as `tolerance` asks (`measured_run`), and what that leaves in the states and the command.

    The controller is called as often as before. Where it switches, or leaves the loop in a limit cycle, a small difference grows to that of
    two cycles out of step, which no integration makes smaller: `small` of the error is then false.
    """
    check_tolerance(setup.system, tolerance)

    def run(integration: Integration) -> tuple[tuple[ClosedLoop, Merit], Outputs]:
        loop, figures = evaluated_loop_compiled(dataclasses.replace(setup, integration=integration), engine)
        outputs = {name: np.asarray(getattr(loop.run, name))[None] for name in SHOWN}
        return (loop, figures), outputs | {setup.system.drive.command[0]: np.asarray(loop.voltage)[None]}

    _, error, found = integrated(run, setup.system, tolerance, alone(setup.system), switches=True)
    return *found, error
