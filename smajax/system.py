"""The whole model: wire x load x drive x effects, and its state at rest."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.drive.base import AbstractDrive
from smajax.effects.base import AbstractEffect
from smajax.load.base import AbstractMovingLoad
from smajax.load.coupon import AbstractCoupon, StrainCoupon
from smajax.parameters import parameter
from smajax.types import Inputs, Motion, Scalar, State
from smajax.wire.heat import cross_section
from smajax.wire.wire import Wire, start


class System(eqx.Module):
    """One actuator (or one coupon) with the effects that its equations carry."""

    wire: Wire
    load: AbstractMovingLoad | AbstractCoupon
    drive: AbstractDrive
    effects: tuple[AbstractEffect, ...] = ()
    start_fraction: Scalar = parameter("-", 0.0, 1.0, "martensite fraction at the start", default=1.0)


def ambient_temperature(system: System, time: Scalar, inputs: Inputs) -> Scalar:
    """Air temperature, C: the channel `ambient_temperature` if there is one, else the parameter; effects may shift it."""
    ambient = inputs.get("ambient_temperature", system.wire.heat.ambient_temperature)
    return ambient + sum(effect.ambient_shift(time) for effect in system.effects)


def load_resistance(system: System, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
    """What the wire has to overcome, N (N m for an arm): the load's own, and what effects add to it."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    lever = load.lever()
    end = lever * (position - load.start()), lever * velocity
    added = sum(effect.resisting_force(load, *end) for effect in system.effects)
    resisting = load.resistance(position, velocity, inputs)
    return resisting if isinstance(added, (int, float)) and added == 0 else resisting + lever * added


def initial_state(system: System, inputs: Inputs) -> State:
    """At rest with the first inputs: a moving load in equilibrium at ambient temperature, a coupon as prescribed."""
    strain = jnp.zeros_like(system.start_fraction)
    if isinstance(system.load, AbstractCoupon):
        temperature = inputs["temperature"]
        position = stress = reading = jnp.zeros_like(temperature)
        if isinstance(system.load, StrainCoupon):
            strain = inputs["strain"]
            position = -strain
        else:
            stress = inputs["stress"]
    else:
        position = reading = system.load.start()
        temperature = ambient_temperature(system, jnp.zeros_like(position), inputs)
        at_rest = load_resistance(system, position, jnp.zeros_like(position), inputs)
        # An end stop may carry part of the load, the wire the rest; what the wire carries is what pulls on it.
        stress = jnp.maximum(at_rest / (system.load.lever() * cross_section(system.wire)), 0.0)
    temperature, stress, strain, position, reading, fraction = jnp.broadcast_arrays(
        temperature, stress, strain, position, reading, system.start_fraction
    )
    zero = jnp.zeros_like(stress)
    wire = start(system.wire, system.effects, temperature, stress, strain, fraction)
    return State(zero, wire, Motion(position, zero, zero), reading)
