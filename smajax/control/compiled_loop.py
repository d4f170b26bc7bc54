"""One closed loop as machine code: for a call by itself, outside of `jit`, `vmap` and `grad`."""

from __future__ import annotations

from smajax.control.closed_loop import ClosedLoop, ClosedLoopSetup, stored_loop
from smajax.control.figures_of_merit import Merit, merit
from smajax.engine import Engine
from smajax.model.types import Scalar
from smajax.simulation.compiled import run_alone


def _run(setup: ClosedLoopSetup, _: dict[str, Scalar]) -> tuple[ClosedLoop, Merit]:
    loop = stored_loop(setup)
    return loop, merit(loop, setup.system)


def evaluated_loop_compiled(setup: ClosedLoopSetup, engine: Engine = "auto") -> tuple[ClosedLoop, Merit]:
    """`simulate_closed_loop` and `merit` of it, arrays of numpy. Errors as there; `engine` as `simulate_compiled`'s."""
    return run_alone(_run, setup, engine)
