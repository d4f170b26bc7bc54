"""The whole model: wire x load x drive x effects, and its state at rest."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.effects.base import AbstractEffect, having
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import AbstractCoupon, StrainCoupon
from smajax.model.sensor_reading import first_reading
from smajax.model.types import Inputs, Motion, Scalar, State, WireState
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.heat import cross_section
from smajax.model.wire.resistance import resistance_per_metre
from smajax.model.wire.wire import Wire, start

# V: less than this heats nothing. A quotient by its square, which a derivative takes, would have no number.
NO_VOLTAGE = 1e-9


class System(eqx.Module):
    """One actuator (or one coupon) with the effects that its equations carry."""

    wire: Wire
    load: AbstractMovingLoad | AbstractCoupon
    drive: AbstractDrive
    effects: tuple[AbstractEffect, ...] = ()
    start_fraction: Scalar = parameter("-", 0.0, 1.0, "martensite fraction at the start", default=1.0)


def recorded_apart(system: System) -> frozenset[str]:
    """Channels that another recorder may have kept than the sensor's, and so be late: the drive's; a coupon's temperature.

    A testing machine records stress and strain together, the temperature comes from elsewhere.
    """
    return frozenset({"temperature"}) if isinstance(system.load, AbstractCoupon) else system.drive.inputs_required


def ambient_temperature(system: System, time: Scalar, inputs: Inputs) -> Scalar:
    """Air temperature, C: the channel `ambient_temperature` if there is one, else the parameter; effects may shift it."""
    ambient = inputs.get("ambient_temperature", system.wire.heat.ambient_temperature)
    return ambient + sum(effect.ambient_shift(time) for effect in system.effects)


def heating_power(system: System, resistance: Scalar, inputs: Inputs, before: WireState | None = None) -> Scalar:
    """Electrical power in each metre of wire, W/m: what the drive gives, less what effects lose before the wire.

    `resistance` is the wire's, ohm/m. `before`: the wire before the step, for a supply that remembers; None: a rested one.
    """
    rested = _rested(system, resistance, inputs)
    tiring = having(system.effects, "supply_drop")
    if not tiring or before is None:
        return rested.power
    voltage, current, per_volt = _given(system, resistance, rested)
    lost = sum(effect.supply_drop(before, current, per_volt) for effect in tiring)
    share = jnp.where(voltage > NO_VOLTAGE, 1.0 - lost / jnp.where(voltage > NO_VOLTAGE, voltage, 1.0), 1.0)
    return rested.power * jnp.where(share > 0.0, share, 0.0) ** 2


def supplied(system: System, inputs: Inputs, before: WireState, after: WireState) -> WireState:
    """`after`, at the end of a step from `before`, with what the supply remembers of that step."""
    remembering = having(system.effects, "kept_after_current")
    if not remembering:
        return after
    ohms = resistance_per_metre(system.wire, system.effects, after.temperature, after.martensite_fraction)
    _, *given = _given(system, ohms, _rested(system, ohms, inputs))
    kept = dict(after.kept)
    for effect in remembering:
        kept |= effect.kept_after_current(before, *given)
    return dataclasses.replace(after, kept=kept)


class _Rested(NamedTuple):
    """What a supply that has given nothing yet gives."""

    power: Scalar  # W per metre of wire
    acting: Inputs  # as the drive makes something of them
    series: Scalar | float  # ohm before the wire


def _rested(system: System, resistance: Scalar, inputs: Inputs) -> _Rested:
    drive, effects, length = system.drive, system.effects, system.wire.wire_length
    acting = dict(inputs)
    for effect in having(effects, "command"):
        acting |= {channel: effect.command(channel, acting[channel]) for channel in drive.inputs_required}
    power = drive.power(resistance, length, acting)
    behind, sagging = having(effects, "series_resistance"), having(effects, "current_sag")
    series = sum(effect.series_resistance() for effect in behind)
    if behind:
        power = power * drive.wire_share(resistance * length, series)
    if sagging:
        asked = drive.drawn_current(resistance * length + series, acting)
        power = power / (1.0 + sum(effect.current_sag() for effect in sagging) * asked) ** 2
    return _Rested(power, acting, series)


def _given(system: System, resistance: Scalar, rested: _Rested) -> tuple[Scalar, Scalar, Scalar]:
    """(voltage while it is on, V; mean current, A; its fall per volt lost, A/V) of a rested supply."""
    whole = resistance * system.wire.wire_length + rested.series
    voltage = system.drive.drawn_current(whole, rested.acting) * whole
    on = voltage > NO_VOLTAGE
    # The wire's power is that of pulses of voltage / whole, for the share of the time that they last.
    current = jnp.where(on, rested.power * whole / (jnp.where(on, voltage, 1.0) * resistance), 0.0)
    return voltage, current, current / jnp.where(on, voltage, 1.0)


def load_resistance(system: System, time: Scalar, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
    """What the wire has to overcome, N (N m for an arm): the load's own, and what effects add to it."""
    load, effects = system.load, system.effects
    assert isinstance(load, AbstractMovingLoad)
    resisting = load.resistance(position, velocity, inputs)
    changing, adding = having(effects, "load_change"), having(effects, "resisting_force")
    if changing:
        static = load.resistance(position, jnp.zeros_like(position), inputs)
        resisting = resisting + sum(effect.load_change(time) for effect in changing) * static
    if adding:
        lever = load.lever()
        moved, speed = lever * (position - load.start()), lever * velocity
        resisting = resisting + lever * sum(effect.resisting_force(load, moved, speed) for effect in adding)
    return resisting


def _stretch(system: System, temperature: Scalar, stress: Scalar) -> Scalar:
    """Strain that goes when the stress does: the wire's own, and that of whatever is in series with it."""
    fraction = system.start_fraction
    straining = having(system.effects, "strain")

    def series(at: Scalar) -> Scalar | float:
        return sum(effect.strain(system.wire, temperature, at, fraction, fraction) for effect in straining)

    return (
        stress / young_modulus(system.wire, fraction, system.effects) + series(stress) - series(jnp.zeros_like(stress))
    )


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
        at_once = jnp.zeros_like(position)
        temperature = ambient_temperature(system, at_once, inputs)
        at_rest = load_resistance(system, at_once, position, jnp.zeros_like(position), inputs)
        # An end stop may carry part of the load, the wire the rest; what the wire carries is what pulls on it.
        stress = jnp.maximum(at_rest / (system.load.lever() * cross_section(system.wire)), 0.0)
        loose = having(system.effects, "loose_length")
        if loose:
            # What the wire is too long by takes the elastic strain first, and then the stop has the load.
            elastic = _stretch(system, temperature, stress)
            too_long = sum(effect.loose_length() for effect in loose) / system.wire.wire_length
            strain = jnp.maximum(too_long - elastic, 0.0)
            stress = stress * jnp.maximum(1.0 - too_long / jnp.where(elastic > 0.0, elastic, jnp.inf), 0.0)
    temperature, stress, strain, position, reading, fraction = jnp.broadcast_arrays(
        temperature, stress, strain, position, reading, system.start_fraction
    )
    zero = jnp.zeros_like(stress)
    wire = start(system.wire, system.effects, temperature, stress, strain, fraction)
    reading, sensor = first_reading(system.effects, reading, zero)
    rubbing = (*having(system.effects, "friction_limit"), *having(system.effects, "friction_share"))
    friction = {effect.effect_name: zero for effect in rubbing}
    return State(zero, wire, Motion(position, zero, friction), reading, sensor)
