"""How a system moves on from one sample of its inputs to the next: one fixed step, or as many as the error asks for.

Each is an `advance` of `integrate`, for inputs by channel (SI; held, or of a coupon those at the end).
"""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.core.where_tree import where_tree
from smajax.model.drive.inputs import BEFORE, switched
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System, prepared
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.integrate import Carry, Schedule, integrate
from smajax.simulation.step import SHORTEST_PART, step


class Integration(eqx.Module):
    """How finely a run is integrated between two samples of its clock; by default one step.

    tolerance: of a moving load, the error of a step, as a share of 1 C and of 1 % strain; None: one step, whatever its error.
    substeps: equal steps, where there is no tolerance; a coupon's temperature and stress (or strain) follow straight lines between two samples.
    most_tries: steps that a run under a tolerance may try, on average a sample; None: as many as it takes.
    """

    tolerance: Scalar | None = None
    substeps: int = eqx.field(static=True, default=1)
    most_tries: Scalar | None = None


ONE_STEP = Integration()
FIRST_SAMPLES = 10.0  # whose tries the first sample may use
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


class EqualSteps(eqx.Module):
    """So many equal steps in `dt` (s), of a moving load, with the inputs held."""

    system: System
    dt: Scalar | float
    substeps: int = eqx.field(static=True)
    once: bool = eqx.field(static=True, default=False)

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with; `inputs` are those at its start."""
        return Carry(state)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        one = FixedStep(self.system, self.dt / self.substeps, self.once)
        return integrate(lambda at, _: one(at, inputs), carry, None, Schedule(self.substeps)).end


class ErrorControlledSteps(eqx.Module):
    """As many steps of order 3 in `dt` (s) as the `tolerance` asks for (`adaptive_steps`), of a moving load.

    With `most_tries` those that a sample does not need are left for the later ones; when they are used up the run has no numbers any more.
    """

    system: System
    dt: Scalar
    tolerance: Scalar
    once: bool = eqx.field(static=True, default=False)
    most_tries: Scalar | None = None

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with: the first step that is tried lasts `dt`."""
        first = lax.stop_gradient(self.dt)
        if self.most_tries is None:
            return Carry(state, first)
        return Carry(state, (first, lax.stop_gradient(FIRST_SAMPLES * self.most_tries)))

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        if self.most_tries is None:
            state, following, _ = self._advanced(carry, inputs, carry.memory)
            return Carry(state, following)
        tried, most = carry.memory
        state, following, taken = self._advanced(carry, inputs, tried, most)
        left = lax.stop_gradient(most - taken)
        # What follows is then quick: a state that is not finite goes to the end of every sample at once.
        state = where_tree(left >= 0.0, state, jax.tree.map(lambda one: jnp.full_like(one, jnp.nan), state))
        return Carry(state, (following, left + self.most_tries))

    def _advanced(
        self, carry: Carry, inputs: Inputs, tried: Scalar, most: Scalar | None = None
    ) -> tuple[State, Scalar, Scalar]:
        return advance(self.system, carry.state, inputs, self.dt, tried, self.tolerance, self.once, most)


class CouponSubsteps(eqx.Module):
    """So many equal steps in `dt` (s), of a coupon whose inputs follow straight lines from sample to sample.

    Twice as many where a temperature that acts late turns within (`acting_inputs`): as many to there, and as many from there on.
    """

    system: System
    dt: Scalar | float
    substeps: int = eqx.field(static=True)

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with; `inputs` are those at its start."""
        _, _, now = switched(inputs) or (None, None, inputs)
        return Carry(state, {name: jnp.asarray(value, dtype=float) for name, value in now.items()})

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        before: Inputs = carry.memory
        share, turn, end = switched(inputs) or (None, None, inputs)
        corners, parts = [before, end], [jnp.ones(())]
        if share is not None and turn is not None:
            # What acts late is given where it turns; the others are on their way.
            on_the_way = {name: before[name] + share * (end[name] - before[name]) for name in end}
            there = {name: turn[name] if BEFORE + name in inputs else on_the_way[name] for name in end}
            # No part without length: a lag of the sensor divides by it.
            first = jnp.clip(share, SHORTEST_PART, 1.0 - SHORTEST_PART)
            corners, parts = [before, there, end], [first, 1.0 - first]
        shares = jnp.arange(1, self.substeps + 1) / self.substeps
        path = [
            {name: left[name] + shares * (right[name] - left[name]) for name in end}
            for left, right in itertools.pairwise(corners)
        ]
        lengths = jnp.repeat(jnp.stack(parts), self.substeps) * (self.dt / self.substeps)
        values = {name: jnp.concatenate([one[name] for one in path]) for name in end}

        def advance(at: Carry, now: tuple[Scalar, Inputs]) -> Carry:
            length, acting = now
            return Carry(step(self.system, at.state, acting, length))

        march = integrate(advance, Carry(carry.state), (lengths, values), Schedule(len(parts) * self.substeps))
        return Carry(march.end.state, dict(end))


class SwitchedSteps(eqx.Module):
    """Two parts in `dt` (s), of a moving load whose command switches within: each part by the stepper `within`.

    The derivative by the time of the switch is that of the lengths of the parts. A switch next to an end of the step is none, so
    that without a delay the run is that of the model without the effect; its derivative by the time is that at `SHORTEST_PART`.
    """

    within: FixedStep | EqualSteps | ErrorControlledSteps

    @property
    def system(self) -> System:
        return self.within.system

    def start(self, state: State, inputs: Inputs) -> Carry:
        """What a run from `state` begins with."""
        return self.within.start(state, inputs)

    def __call__(self, carry: Carry, inputs: Inputs) -> Carry:
        commands = switched(inputs)
        if commands is None:  # a command that does not change in time has no series to be late
            return self.within(carry, inputs)
        share, before, after = commands
        at_end = (share < SHORTEST_PART) | (share > 1.0 - SHORTEST_PART)

        clipped = share + lax.stop_gradient(jnp.clip(share, SHORTEST_PART, 1.0 - SHORTEST_PART) - share)
        lengths = self.within.dt * jnp.stack([clipped, 1.0 - clipped, jnp.ones_like(clipped)])
        one = {name: jnp.where(share < 0.5, after[name], before[name]) for name in after}
        held = {name: jnp.stack([jnp.asarray(before[name], dtype=float), after[name], one[name]]) for name in after}

        # One scan, so that the step is compiled once: the two parts, then the whole step from where they began.
        def advance(parts: Carry, now: tuple[Any, Scalar, Inputs]) -> Carry:
            number, length, command = now
            _, at = parts.state
            start = where_tree(number == 1, at, _without_derivative(at_end & (number == 0), carry))
            within, command = _without_derivative(at_end & (number < 2), (self.within, command))
            new = dataclasses.replace(within, dt=length)(start, command)
            # How long a step may be is not learned from a part of next to no length.
            none = length < SAYS_NOTHING * self.within.dt
            return Carry((at, Carry(new.state, where_tree(none, start.memory, new.memory))))

        march = integrate(advance, Carry((carry, carry)), (jnp.arange(3), lengths, held), Schedule(3))
        split, whole = march.end.state
        moved = jax.tree.map(lambda alone, two: alone + (two - lax.stop_gradient(two)), whole.state, split.state)
        # What is remembered of steps has no derivative, and may be infinite.
        return where_tree(at_end, Carry(moved, whole.memory), split)


def _without_derivative(condition: Any, tree: Any) -> Any:
    """`tree`, whose numbers have no derivative where the condition holds."""
    numbers, rest = eqx.partition(tree, eqx.is_inexact_array)
    return eqx.combine(where_tree(condition, lax.stop_gradient(numbers), numbers), rest)


Stepper = FixedStep | EqualSteps | ErrorControlledSteps | CouponSubsteps | SwitchedSteps


def stepper_of(system: System, dt: Scalar | float, integration: Integration = ONE_STEP, once: bool = False) -> Stepper:
    """The stepper that `integration` asks for of this load. What is the same in every step is computed here."""
    system = prepared(system)
    if isinstance(system.load, AbstractMovingLoad):
        whole: FixedStep | EqualSteps | ErrorControlledSteps = FixedStep(system, dt, once)
        if integration.substeps > 1:
            whole = EqualSteps(system, dt, integration.substeps, once)
        if integration.tolerance is not None:
            whole = ErrorControlledSteps(
                system, jnp.asarray(dt, dtype=float), integration.tolerance, once, integration.most_tries
            )
        return SwitchedSteps(whole) if system.terms.input_lag and system.drive.inputs_required else whole
    if integration.substeps > 1 or system.terms.input_lag:
        return CouponSubsteps(system, dt, integration.substeps)
    return FixedStep(system, dt, once)
