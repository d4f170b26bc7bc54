"""What one stage of a step solves: heat, motion and stress at its end, of a moving load."""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from smajax.effects.base import having
from smajax.load.base import AbstractMovingLoad
from smajax.system import System, ambient_temperature, heating_power, load_resistance
from smajax.types import Inputs, Scalar, State
from smajax.wire.constitutive import stress_at
from smajax.wire.heat import cross_section, heat_rate, stored_heat
from smajax.wire.resistance import resistance_per_metre

# Coulomb friction builds up over this much motion (a bristle bends before it slips), in units of position.
PRESLIDING = 2e-5


class Unknowns(NamedTuple):
    """What a stage solves for, in the order of elimination."""

    temperature: Scalar
    position: Scalar
    stress: Scalar
    fraction: Scalar


class Stage(eqx.Module):
    """What a stage starts from: the state before it, and the base values of the scheme."""

    old: State
    time: Scalar
    step: Scalar  # g = gamma dt, s
    heat: Scalar  # H_b, J/m
    position: Scalar  # x_b
    velocity: Scalar  # v_b
    enough: float = eqx.field(static=True)  # how far the last iteration may still move the solution (`stage_solver`)
    once: bool = eqx.field(static=True)  # differentiated once at most (`step`)


def friction_in_use(stage: Stage, position: Scalar) -> tuple[Scalar, Scalar]:
    """(share of the Coulomb limit in use, the same before it is held within -1..1)."""
    raw = stage.old.motion.friction + (position - stage.old.motion.position) / PRESLIDING
    return jnp.clip(raw, -1.0, 1.0), raw


def friction_limit(system: System, velocity: Scalar, inputs: Inputs) -> Scalar | None:
    """Largest friction in the unit of the load's resistance; None where no effect has friction."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    rubbing, bearing = having(system.effects, "friction_limit"), having(system.effects, "friction_share")
    if not rubbing and not bearing:
        return None
    speed = load.lever() * velocity
    limits = [effect.friction_limit(speed) for effect in rubbing]
    if bearing:
        at_rest = jnp.abs(load.resistance(load.start(), jnp.zeros_like(velocity), inputs))
        limits += [effect.friction_share(speed) * at_rest for effect in bearing]
    return jnp.sum(jnp.stack([jnp.asarray(one) for one in limits]))


def _heating(system: System, stage: Stage, inputs: Inputs, temperature: Scalar, fraction: Scalar) -> Scalar:
    wire, effects = system.wire, system.effects
    ohms = resistance_per_metre(wire, effects, temperature, fraction)
    power = heating_power(system, ohms, inputs, stage.old.wire)
    ambient = ambient_temperature(system, stage.time, inputs)
    return heat_rate(wire, effects, temperature, ambient, power, stage.time)


def motion_rates(stage: Stage, position: Scalar) -> tuple[Scalar, Scalar]:
    """(v, a) at the end of a stage that ends at `position`."""
    velocity = (position - stage.position) / stage.step
    return velocity, (velocity - stage.velocity) / stage.step


def _free_position(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> Scalar:
    """The position less what the equation of motion is off by, in units of position; `z.position` where it holds."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    velocity, acceleration = motion_rates(stage, z.position)
    inertia = load.inertia(inputs)
    # At the speed before the step: with friction that falls with the speed a step of any length has one answer then,
    # where at its own speed both sticking and sliding on may be one.
    limit = friction_limit(system, stage.old.motion.velocity, inputs)
    friction = 0.0 if limit is None else limit * friction_in_use(stage, z.position)[0]
    pull = load.lever() * cross_section(system.wire) * z.stress
    resisting = load_resistance(system, stage.time, z.position, velocity, inputs) + friction
    return z.position - (inertia * acceleration + resisting - pull) * stage.step**2 / inertia


class Missed(NamedTuple):
    """By how much three equations of a stage are missed, each in the unit of the unknown that it is solved for.

    The fourth equation, of the kinetics, depends on the branch.
    """

    heat: Scalar
    motion: Scalar
    stress: Scalar
    free: Scalar  # not an equation: where the load would be without end stops


def equations(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> Missed:
    """Heat, motion and stress of a stage, zero at the solution."""
    wire, effects, load, old = system.wire, system.effects, system.load, stage.old.wire
    assert isinstance(load, AbstractMovingLoad)
    heating = _heating(system, stage, inputs, z.temperature, z.fraction)
    capacity = stored_heat(wire, (), jnp.ones_like(z.temperature), z.fraction)
    heat = stored_heat(wire, effects, z.temperature, z.fraction) - stage.heat - stage.step * heating
    taking = having(effects, "heat_of_change")
    if taking:
        taken = sum(effect.heat_of_change(wire, old, z.temperature, z.fraction) for effect in taking)
        # As a rate over the stage, like all else that heats: a later stage of a step is longer than its own base.
        heat = heat + taken * stage.step / (stage.time - stage.old.time)
    heat = heat / capacity

    # Projected on the range between the end stops: at a stop the equation reads "position = stop".
    free = _free_position(system, stage, inputs, z)
    lower, upper = load.limits()
    motion = z.position - jnp.where(free < lower, lower, jnp.where(free > upper, upper, free))

    strain = -load.contraction(wire) * (z.position - load.start())
    asked = stress_at(wire, effects, old, strain, z.temperature, z.stress, z.fraction)
    return Missed(heat, motion, z.stress - asked, free)
