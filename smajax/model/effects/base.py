"""An effect: a missing piece of physics with coefficients, in the equations whose contracts it inherits from.

An effect is an immutable module whose coefficients are `parameter` fields; the default of each is its base value. With
its switches at their base value (zero) every method must return exactly what the base model has, so that the extended
model contains the base model. What it may change is said beside each equation, by a class of one to three methods:

| equation | contract | its methods |
|---|---|---|
| heat balance | `wire.heat.HeatTerm` | `stored_heat(wire, temperature, fraction)`, `heat_loss(wire, at)`, `ambient_shift(time)` |
| resistance | `wire.resistance.ResistanceTerm` | `resistance_factor(temperature, fraction)` |
| kinetics: shape | `wire.kinetics_terms.ShapeTerm` | `heating_shape(z, remaining)`, `cooling_shape(z, remaining)` |
| kinetics: place on the shape | `wire.kinetics_terms.PlaceTerm` | `heating_place(z)`, `cooling_place(z)`, `place_on(cooling, z)` |
| kinetics: range | `wire.kinetics_terms.RangeTerm` | `heating_distance(law, z, temperature, stress, old)`, `cooling_distance(law, z, temperature, stress, old)` |
| kinetics: a second part of the wire | `wire.kinetics_terms.PopulationTerm` | `second_conditions()` |
| constitutive law | `wire.constitutive.ConstitutiveTerm` | `strain(wire, at)`, `modulus_change(wire, fraction)` |
| any of these, where the path matters | `wire.history.HistoryTerm` | `history_at_start(at)`, `history_after(old, new)`, `turn_within(law, temperature, stress, old)` |
| motion: force | `load.force.ForceTerm` | `resisting_force(load, at)` |
| motion: friction | `load.friction.FrictionTerm` | `friction_limit(load_at_rest)`, `friction_level(speed)`, `presliding()` |
| motion: mounting | `load.mounting.MountingTerm` | `loose_length()` |
| drive | `drive.inputs.CommandTerm` | `command(channel, value)` |
| supply: leads | `drive.supply.SeriesTerm` | `series_resistance()` |
| supply: voltage | `drive.supply.SupplyTerm` | `voltage_share(circuit, old)`, `history_after_supply(circuit, old)` |
| sensor | `sensor_reading.SensorTerm` | `sensed(reading, time, last)` |
| sensor: lag | `sensor_reading.SensorLagTerm` | `sensor_time_constant()` |
| recorded input | `drive.inputs.InputLagTerm` | `input_lag(time)` |

`sma.contracts` has all of them. The equations know these contracts and no effect; `effects.grouping` sorts the effects of a system by them.
"""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any, ClassVar, Self

import equinox as eqx

from smajax.model.effects.candidate import Candidate


class AbstractEffect(eqx.Module):
    """One candidate for what a model lacks: its name, and what the search for missing effects knows of it."""

    effect_name: ClassVar[str]  # "latent_heat"
    candidate: ClassVar[Candidate]

    @classmethod
    def base(cls) -> Self:
        """The effect at its base value: present in the equations and changing nothing."""
        return cls()

    def prepared(self) -> Self:
        """The effect with what is of its coefficients alone computed: asked for once a run, before its first step.

        Its coefficients are not to be replaced after that: what was computed of them stays.
        """
        return self


# Names of version 0.1 -> where they are now; until version 0.3.
_MOVED = {"Extent": "smajax.model.effects.candidate", "PRESLIDING": "smajax.model.load.friction"}


def __getattr__(name: str) -> Any:
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    message = f"{__name__}.{name} is {_MOVED[name]}.{name} now; the old path is removed in version 0.3"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return getattr(import_module(_MOVED[name]), name)
