"""The whole model: wire x load x drive x effects, and its state at rest."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive import supply
from smajax.model.drive.base import AbstractDrive
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.grouping import Terms, check_effects, grouped
from smajax.model.effects.history_errors import history_entries_named
from smajax.model.load import force
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.coupon import AbstractCoupon, StrainCoupon
from smajax.model.sensor_reading import LevelTerm, first_reading
from smajax.model.types import Inputs, Motion, Scalar, State, WireState
from smajax.model.wire.constitutive import effect_strain, young_modulus
from smajax.model.wire.heat import cross_section
from smajax.model.wire.order import check_order
from smajax.model.wire.resistance import resistance_per_metre
from smajax.model.wire.start import start
from smajax.model.wire.wire import Wire


class System(eqx.Module):
    """One actuator (or one coupon) with the effects that its equations carry. Raises TypeError for what is no effect."""

    wire: Wire
    load: AbstractMovingLoad | AbstractCoupon
    drive: AbstractDrive
    effects: tuple[AbstractEffect, ...] = ()
    start_fraction: Scalar = parameter("-", 0.0, 1.0, "martensite fraction at the start", default=1.0)

    def __check_init__(self) -> None:
        check_effects(self.effects)

    @property
    def units_of_load(self) -> dict[str, str]:
        """Units (SI, rad) of what parameters of effects are measured as (`of_load` of `core.parameters.parameter`)."""
        reading = self.load.reading[1]
        result = {"reading": reading, "reading rate": "1/s" if reading == "-" else f"{reading}/s"}
        if isinstance(self.load, AbstractMovingLoad):
            result["force"] = "N m" if self.load.position_unit == "rad" else "N"
        return result

    def check_order(self) -> None:
        """ValueError for transformation temperatures or end stops in the wrong order, where they are known."""
        check_order(self)

    @property
    def terms(self) -> Terms:
        """The effects by the equation that they change. By their types, at the cost of a few microseconds; no leaf of its own."""
        return grouped(self.effects)


def prepared(system: System) -> System:
    """`system` with what its effects compute once a run."""
    return dataclasses.replace(system, effects=tuple(one.prepared() for one in system.effects))


def recorded_apart(system: System) -> frozenset[str]:
    """Channels that another recorder may have written than the sensor's, and that may so be late: the drive's; a coupon's temperature.

    A testing machine records stress and strain together, the temperature comes from elsewhere.
    """
    return frozenset({"temperature"}) if isinstance(system.load, AbstractCoupon) else system.drive.inputs_required


def ambient_temperature(system: System, time: Scalar, inputs: Inputs) -> Scalar:
    """Air temperature, C: the channel `ambient_temperature` if there is one, else the parameter; effects may shift it."""
    ambient = inputs.get("ambient_temperature", system.wire.heat.ambient_temperature)
    return ambient + sum(term.ambient_shift(time) for term in system.terms.heat)


def heating_power(system: System, resistance: Scalar, inputs: Inputs, old: WireState | None = None) -> Scalar:
    """Electrical power in each metre of wire, W/m: what the drive gives, less what effects lose before the wire.

    `resistance` is the wire's, ohm/m. `old`: the wire before the step, for a supply whose voltage depends on what it gave;
    None: a rested one.
    """
    return supply.heating_power(system.drive, system.terms.supply, system.wire.wire_length, resistance, inputs, old)


def with_supply_history(system: System, inputs: Inputs, old: WireState, new: WireState) -> WireState:
    """`new`, at the end of a step from `old`, with the history of the supply brought up to date."""
    terms = system.terms
    if not terms.supply.supplies:
        return new
    ohms = resistance_per_metre(system.wire, terms.resistance, new.temperature, new.martensite_fraction)
    entries = supply.history_after_supply(system.drive, terms.supply, system.wire.wire_length, ohms, inputs, old)
    return dataclasses.replace(new, history={**new.history, **entries})


def without_levels(system: System) -> tuple[System, LevelTerm | None]:
    """(`system` with a sensor that shows everything, what shows levels of it last), for readings that are compared with measured ones."""
    levels = [one for one in system.effects if isinstance(one, LevelTerm)]
    if not levels:
        return system, None
    last = levels[-1]
    return dataclasses.replace(system, effects=tuple(one for one in system.effects if one is not last)), last


def with_mean_slopes(system: System, noise: Scalar | float) -> System:
    """`system` whose sensor's levels, if it shows any, have the derivative of what they tell (`LevelTerm.with_mean_slope`); `noise` of its readings."""
    effects = tuple(one.with_mean_slope(noise) if isinstance(one, LevelTerm) else one for one in system.effects)
    return dataclasses.replace(system, effects=effects)


def load_resistance(system: System, time: Scalar, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
    """What the wire has to overcome, N (N m for an arm): the load's own, and what effects add to it."""
    assert isinstance(system.load, AbstractMovingLoad)
    return force.load_resistance(system.load, system.terms.force, time, position, velocity, inputs)


def _elastic_strain(system: System, at: WireState) -> Scalar:
    """Strain that goes when the stress does: the wire's own, and that of whatever is in series with it."""
    terms = system.terms.constitutive
    at = dataclasses.replace(at, detwinned_fraction=at.martensite_fraction)
    unloaded = dataclasses.replace(at, stress=jnp.zeros_like(at.stress))
    elastic = at.stress / young_modulus(system.wire, at.martensite_fraction, terms)
    return elastic + effect_strain(system.wire, terms, at) - effect_strain(system.wire, terms, unloaded)


@history_entries_named()
def initial_state(system: System, inputs: Inputs) -> State:
    """At rest with the first inputs: a moving load in equilibrium at ambient temperature, a coupon as prescribed."""
    terms = system.terms
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
        position = system.load.start()
        reading = system.load.sensed(position)
        at_once = jnp.zeros_like(position)
        temperature = ambient_temperature(system, at_once, inputs)
        at_rest = load_resistance(system, at_once, position, jnp.zeros_like(position), inputs)
        # An end stop may carry part of the load, the wire the rest; what the wire carries is what pulls on it.
        stress = jnp.maximum(at_rest / (system.load.lever() * cross_section(system.wire)), 0.0)
        if terms.mounting:
            # What the wire is too long by takes the elastic strain first, and then the stop has the load.
            fraction = system.start_fraction
            at = start(system.wire, temperature, stress, strain, fraction, terms.kinetics, terms.history)
            elastic = _elastic_strain(system, at)
            too_long = sum(term.loose_length() for term in terms.mounting) / system.wire.wire_length
            strain = jnp.maximum(too_long - elastic, 0.0)
            stress = stress * jnp.maximum(1.0 - too_long / jnp.where(elastic > 0.0, elastic, jnp.inf), 0.0)
    temperature, stress, strain, position, reading, fraction = jnp.broadcast_arrays(
        temperature, stress, strain, position, reading, system.start_fraction
    )
    zero = jnp.zeros_like(stress)
    wire = start(system.wire, temperature, stress, strain, fraction, terms.kinetics, terms.history)
    reading, sensor = first_reading(terms.sensor, reading, zero)
    friction = {term.effect_name: zero for term in terms.friction}
    return State(zero, wire, Motion(position, zero, friction), reading, sensor, zero)
