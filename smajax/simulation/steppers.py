"""How a system moves on from one sample of its inputs to the next: one fixed step, or as many as the error asks for.

Both are an `advance` of `integrate`, for inputs by channel (SI, held).
"""

from __future__ import annotations

import equinox as eqx

from smajax.model.system import System
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.integrate import Carry
from smajax.simulation.step import step


class FixedStep(eqx.Module):
    """One step of `dt` (s), of order 2 (`step`)."""

    system: System
    dt: Scalar | float
    once: bool = eqx.field(static=True, default=False)  # differentiated once at most (`step`)

    def start(self, state: State) -> Carry:
        """What a run from `state` begins with."""
        return Carry(state)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        return Carry(step(self.system, carry.state, inputs, self.dt, self.once))


class ErrorControlledSteps(eqx.Module):
    """As many steps of order 3 in `dt` (s) as the `tolerance` asks for (`adaptive_steps`), of a moving load."""

    system: System
    dt: Scalar
    tolerance: Scalar

    def start(self, state: State) -> Carry:
        """What a run from `state` begins with: the first step that is tried lasts `dt`."""
        return Carry(state, self.dt)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        state, following, _ = advance(self.system, carry.state, inputs, self.dt, carry.memory, self.tolerance)
        return Carry(state, following)


Stepper = FixedStep | ErrorControlledSteps


def stepper_of(system: System, dt: Scalar, tolerance: Scalar | None, once: bool = False) -> Stepper:
    """Error-controlled steps where there is a `tolerance`, otherwise fixed ones."""
    return FixedStep(system, dt, once) if tolerance is None else ErrorControlledSteps(system, dt, tolerance)
