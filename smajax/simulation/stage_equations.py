"""What one stage of a step solves: heat, motion and stress at its end, of a moving load."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.friction import holding, rubbing
from smajax.model.system import System, ambient_temperature, heating_power, load_resistance
from smajax.model.types import Inputs, Scalar, State
from smajax.model.wire.constitutive import stress_at
from smajax.model.wire.heat import HeatState, cross_section, heat_rate, stored_heat
from smajax.model.wire.resistance import resistance_per_metre


class Unknowns(NamedTuple):
    """What a stage solves for, in the order of elimination."""

    temperature: Scalar
    # From the base of the stage: the velocity is the displacement over the step, of which a difference of two positions leaves
    # single precision two digits.
    displacement: Scalar
    stress: Scalar
    fraction: Scalar


class Stage(eqx.Module):
    """What a stage starts from: the state before it, and the base values of the scheme."""

    old: State
    time: Scalar
    elapsed: Scalar  # since the state before it, s: a difference of times would be rounded
    step: Scalar  # g = gamma dt, s
    heat: Scalar  # H_b, J/m
    position: Scalar  # x_b
    velocity: Scalar  # v_b
    enough: float = eqx.field(static=True)  # how far the last iteration may still move the solution (`stage_solver`)
    once: bool = eqx.field(static=True)  # differentiated once at most (`step`)


def _heating(system: System, stage: Stage, inputs: Inputs, temperature: Scalar, fraction: Scalar) -> Scalar:
    wire, terms, old = system.wire, system.terms, stage.old
    ohms = resistance_per_metre(wire, terms.resistance, temperature, fraction)
    power = heating_power(system, ohms, inputs, old.wire)
    ambient = ambient_temperature(system, stage.time, inputs)
    # What changes over a stage counts from the state before it: a later stage of a step is longer than its own base.
    at = HeatState(temperature, ambient, fraction, stage.time, old.wire, stage.elapsed)
    return heat_rate(wire, terms.heat, at, power)


def motion_rates(stage: Stage, displacement: Scalar) -> tuple[Scalar, Scalar]:
    """(v, a) at the end of a stage that ends `displacement` from its base."""
    velocity = displacement / stage.step
    return velocity, (velocity - stage.velocity) / stage.step


def _free_displacement(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> Scalar:
    """The displacement less what the equation of motion is off by, in units of position; `z.displacement` where it holds."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    position = stage.position + z.displacement
    velocity, acceleration = motion_rates(stage, z.displacement)
    inertia = load.inertia(inputs)
    before = stage.old.motion
    friction = sum(
        one.limit * holding(one, before, position, velocity, stage.elapsed)
        for one in rubbing(load, system.terms.friction, before, stage.velocity, inputs)
    )
    pull = load.lever() * cross_section(system.wire) * z.stress
    resisting = load_resistance(system, stage.time, position, velocity, inputs) + friction
    return z.displacement - (inertia * acceleration + resisting - pull) * stage.step**2 / inertia


def beyond_stops(system: System, stage: Stage, free: Scalar) -> tuple[Bool[Array, ""], Bool[Array, ""]]:
    """Whether a displacement leads beyond the lower end stop, and beyond the upper one.

    By the position, in which the rounding of a displacement is lost: a load that rests at its stop is not held by it.
    """
    assert isinstance(system.load, AbstractMovingLoad)
    lower, upper = system.load.limits()
    position = stage.position + free
    return position < lower, position > upper


class Residuals(NamedTuple):
    """Residuals of three equations of a stage, each in the unit of the unknown that it is solved for.

    The fourth equation, of the kinetics, depends on the branch.
    """

    heat: Scalar
    motion: Scalar
    stress: Scalar
    free: Scalar  # not an equation: the displacement without end stops


def equations(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> Residuals:
    """Heat, motion and stress of a stage, zero at the solution."""
    wire, terms, load, old = system.wire, system.terms, system.load, stage.old.wire
    assert isinstance(load, AbstractMovingLoad)
    heating = _heating(system, stage, inputs, z.temperature, z.fraction)
    capacity = stored_heat(wire, (), jnp.ones_like(z.temperature), z.fraction)
    heat = stored_heat(wire, terms.heat, z.temperature, z.fraction) - stage.heat - stage.step * heating
    heat = heat / capacity

    # Projected on the range between the end stops: at a stop the equation reads "position = stop".
    free = _free_displacement(system, stage, inputs, z)
    lower, upper = load.limits()
    below, above = beyond_stops(system, stage, free)
    ended = jnp.where(below, lower - stage.position, jnp.where(above, upper - stage.position, free))
    motion = z.displacement - ended

    strain = -load.contraction(wire) * (stage.position + z.displacement - load.start())
    expected = stress_at(wire, terms.constitutive, old, strain, z.temperature, z.stress, z.fraction)
    return Residuals(heat, motion, z.stress - expected, free)
