"""How a system moves on from one sample of its inputs to the next: one fixed step, or as many as the error asks for.

Each is an `advance` of `integrate`, for inputs by channel (SI; held, or of a coupon those at the end).
"""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.model.drive.inputs import switched
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.integrate import Carry, Schedule, integrate
from smajax.simulation.step import step


class Integration(eqx.Module):
    """How finely a run is integrated between two samples of its clock; by default one step.

    tolerance: of a moving load, the error of a step, as a share of 1 C and of 1 % strain; None: one step, whatever its error.
    substeps: of a coupon, whose temperature and stress (or strain) follow straight lines between two samples.
    """

    tolerance: Scalar | None = None
    substeps: int = eqx.field(static=True, default=1)


ONE_STEP = Integration()
# Shortest part of a step on either side of a switch of the command, as a power of the rounding: 1.3e-6 in float64. Rounding in the
# derivative by the time of the switch grows as the inverse square of the part: at 1.3e-6 it is below 2e-4, at 1e-8 of its own size.
SHORTEST_PART = 0.375
SAYS_NOTHING = 0.01  # of a step: the next one would grow from there by four at a time


class FixedStep(eqx.Module):
    """One step of `dt` (s), of order 2 (`step`)."""

    system: System
    dt: Scalar | float
    once: bool = eqx.field(static=True, default=False)  # differentiated once at most (`step`)

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with; `inputs` are those at its start."""
        return Carry(state)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        return Carry(step(self.system, carry.state, inputs, self.dt, self.once))


class ErrorControlledSteps(eqx.Module):
    """As many steps of order 3 in `dt` (s) as the `tolerance` asks for (`adaptive_steps`), of a moving load."""

    system: System
    dt: Scalar
    tolerance: Scalar
    once: bool = eqx.field(static=True, default=False)

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with: the first step that is tried lasts `dt`."""
        return Carry(state, lax.stop_gradient(self.dt))

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        state, following, _ = advance(
            self.system, carry.state, inputs, self.dt, carry.memory, self.tolerance, self.once
        )
        return Carry(state, following)


class CouponSubsteps(eqx.Module):
    """So many equal steps in `dt` (s), of a coupon whose inputs follow straight lines from sample to sample."""

    system: System
    dt: Scalar | float
    substeps: int = eqx.field(static=True)

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with; `inputs` are those at its start."""
        return Carry(state, {name: jnp.asarray(value, dtype=float) for name, value in inputs.items()})

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        before: Inputs = carry.memory

        def advance(at: Carry, share: Scalar) -> Carry:
            now = {name: before[name] + share * (inputs[name] - before[name]) for name in inputs}
            return Carry(step(self.system, at.state, now, self.dt / self.substeps))

        shares = jnp.arange(1, self.substeps + 1) / self.substeps
        end = integrate(advance, Carry(carry.state), shares, Schedule(self.substeps)).end
        return Carry(end.state, dict(inputs))


class SwitchedSteps(eqx.Module):
    """Two parts in `dt` (s), of a moving load whose command switches within: each part by the stepper `within`.

    The derivative by the time of the switch is that of the lengths of the parts. Neither is of no length (`SHORTEST_PART`), for
    which a step has no derivative by it.
    """

    within: FixedStep | ErrorControlledSteps

    @property
    def system(self) -> System:
        return self.within.system

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with."""
        return self.within.start(state, inputs)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        parts = switched(inputs)
        if parts is None:  # a command that does not change in time has no series to be late
            return self.within(carry, inputs)
        share, before, after = parts
        shortest = float(jnp.finfo(share.dtype).eps) ** SHORTEST_PART
        share = share + lax.stop_gradient(jnp.clip(share, shortest, 1.0 - shortest) - share)
        lengths = self.within.dt * jnp.stack([share, 1.0 - share])
        held = {name: jnp.stack([jnp.asarray(before[name], dtype=float), after[name]]) for name in after}

        def advance(at: Carry, part: tuple[Scalar, Inputs]) -> Carry:
            length, now = part
            new = dataclasses.replace(self.within, dt=length)(at, now)
            # How long a step may be is not learned from a part of next to no length.
            none = length < SAYS_NOTHING * self.within.dt
            return Carry(new.state, jax.tree.map(lambda old, own: jnp.where(none, old, own), at.memory, new.memory))

        return integrate(advance, carry, (lengths, held), Schedule(2)).end


Stepper = FixedStep | ErrorControlledSteps | CouponSubsteps | SwitchedSteps


def stepper_of(system: System, dt: Scalar | float, integration: Integration = ONE_STEP, once: bool = False) -> Stepper:
    """The stepper that `integration` asks for of this load."""
    if isinstance(system.load, AbstractMovingLoad):
        whole: FixedStep | ErrorControlledSteps = FixedStep(system, dt, once)
        if integration.tolerance is not None:
            whole = ErrorControlledSteps(system, jnp.asarray(dt, dtype=float), integration.tolerance, once)
        return SwitchedSteps(whole) if system.terms.input_lag and system.drive.inputs_required else whole
    return (
        FixedStep(system, dt, once) if integration.substeps == 1 else CouponSubsteps(system, dt, integration.substeps)
    )
