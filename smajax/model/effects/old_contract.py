"""Effects of the form of version 0.1, when one class had a method for every equation: they work for one minor version more.

Such an effect inherits from `AbstractEffect` alone, overrides methods of the old names and says what the search needs in
class attributes. `adopt` makes it one of today: it registers the class with the contracts of its methods, translates those
whose arguments have changed, and gathers the attributes in a `Candidate`.
"""

from __future__ import annotations

import warnings
from abc import ABCMeta
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp

from smajax.model.drive.inputs import CommandTerm, InputLagTerm
from smajax.model.drive.supply import NO_VOLTAGE, SeriesTerm, SupplyTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate
from smajax.model.effects.contract_check import CONTRACTS, methods
from smajax.model.load.force import ForceTerm
from smajax.model.load.friction import FrictionTerm
from smajax.model.load.mounting import MountingTerm
from smajax.model.sensor_reading import SensorLagTerm, SensorTerm
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import HeatTerm, convection
from smajax.model.wire.history import HistoryTerm
from smajax.model.wire.kinetics_terms import PopulationTerm, RangeTerm, ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm

# Old method: the contract that has it, or what took it in.
OLD: dict[str, ABCMeta] = {
    **dict.fromkeys(("stored_heat", "heat_of_change", "heat_loss", "convection_change", "ambient_shift"), HeatTerm),
    "resistance_factor": ResistanceTerm,
    "command": CommandTerm,
    "series_resistance": SeriesTerm,
    **dict.fromkeys(("current_sag", "supply_drop", "kept_after_current"), SupplyTerm),
    **dict.fromkeys(("heating_shape", "cooling_shape"), ShapeTerm),
    **dict.fromkeys(("heating_distance", "cooling_distance"), RangeTerm),
    "second_conditions": PopulationTerm,
    **dict.fromkeys(("kept_at_start", "kept_after"), HistoryTerm),
    **dict.fromkeys(("strain", "kept_strain", "modulus_change"), ConstitutiveTerm),
    **dict.fromkeys(("friction_limit", "friction_share", "friction_level", "presliding"), FrictionTerm),
    "loose_length": MountingTerm,
    **dict.fromkeys(("resisting_force", "load_change"), ForceTerm),
    "input_lag": InputLagTerm,
    "sensor_time_constant": SensorLagTerm,
    "sensed": SensorTerm,
}
# Old class attribute or class method: its name in `Candidate`.
SAID = {
    **{name: name for name in ("title", "equation", "formula", "sentence", "switches", "needs_time", "applies")},
    "starts": "initial_guess",
    "jumps": "stick_slip",
    "shows": "observable",
    "places": "grid",
    "spans": "bounds",
    "begins": "start_ranges",
}
_adopted: dict[type, dict[str, Callable[..., Any]]] = {}  # old methods of a class that has been adopted


def adopt(effect: type[AbstractEffect]) -> None:
    """Make a class of the old form one of today, with a DeprecationWarning; nothing for any other."""
    if effect in _adopted or any(contract in effect.__mro__ for contract in CONTRACTS):
        return
    old: dict[str, Callable[..., Any]] = {}
    for one in reversed(effect.__mro__):
        old |= _adopted.get(one) or {name: getattr(one, name) for name in vars(one) if name in OLD}
    if not old:
        return
    _adopted[effect] = old
    contracts = list(dict.fromkeys(OLD[name] for name in old))
    names = ", ".join(contract.__name__ for contract in contracts)
    warnings.warn(
        f"{effect.__module__}.{effect.__qualname__} is an effect of the old form, which goes in version 0.3: let it inherit "
        f"from {names} too, and give it a `Candidate` (docs/how-to/add-an-effect.md).",
        DeprecationWarning,
        stacklevel=3,
    )
    translated = _translated(old)
    for contract in contracts:
        contract.register(effect)
        for name in methods(contract):
            if name in translated or not hasattr(effect, name):
                setattr(effect, name, translated.get(name) or getattr(contract, name))
        if contract is SensorTerm and not hasattr(effect, "recalls"):
            effect.recalls = SensorTerm.recalls
    said = {new: getattr(effect, name) for name, new in SAID.items() if hasattr(effect, name)}
    if {"title", "equation", "formula", "sentence", "switches", "initial_guess"} <= said.keys():
        effect.candidate = Candidate(**said)


def _translated(old: dict[str, Callable[..., Any]]) -> dict[str, Callable[..., Any]]:
    """Methods of today from old ones whose arguments have changed."""

    def call(name: str, *arguments: Any) -> Any:
        return old[name](*arguments) if name in old else 0.0

    def heat_loss(self: Any, wire: Any, at: Any) -> Any:
        loss = call("heat_loss", self, wire, at.temperature, at.ambient)
        loss += call("convection_change", self, at.time) * convection(wire, at.temperature, at.ambient)
        return loss + call("heat_of_change", self, wire, at.old, at.temperature, at.fraction) / at.duration

    def strain(self: Any, wire: Any, at: Any) -> Any:
        state = at.temperature, at.stress, at.martensite_fraction, at.detwinned_fraction
        return call("strain", self, wire, *state) + call("kept_strain", self, at)

    def history_at_start(self: Any, at: Any) -> Any:
        return old["kept_at_start"](self, at.temperature, at.stress, at.martensite_fraction)

    def history_after(self: Any, before: Any, new: Any) -> Any:
        return old["kept_after"](self, before, new.temperature, new.stress, new.martensite_fraction)

    def friction_limit(self: Any, load_at_rest: Any) -> Any:
        return jnp.asarray(call("friction_limit", self) + call("friction_share", self) * load_at_rest)

    def resisting_force(self: Any, load: Any, at: Any) -> Any:
        force = call("resisting_force", self, load, at.displacement, at.speed)
        return force + call("load_change", self, at.time) * at.static_force

    def voltage_share(self: Any, circuit: Any, before: Any) -> Any:
        share = 1.0 / (1.0 + call("current_sag", self) * circuit.peak_current)
        if "supply_drop" not in old or before is None:
            return share
        on = circuit.voltage > NO_VOLTAGE
        lost = old["supply_drop"](self, before, circuit.current, circuit.per_volt)
        return share * jnp.maximum(jnp.where(on, 1.0 - lost / jnp.where(on, circuit.voltage, 1.0), 1.0), 0.0)

    def history_after_supply(self: Any, circuit: Any, before: Any) -> Any:
        return old["kept_after_current"](self, before, circuit.current, circuit.per_volt)

    made: dict[Callable[..., Any], tuple[str, ...]] = {
        heat_loss: ("heat_loss", "convection_change", "heat_of_change"),
        strain: ("strain", "kept_strain"),
        history_at_start: ("kept_at_start",),
        history_after: ("kept_after",),
        friction_limit: ("friction_limit", "friction_share"),
        resisting_force: ("resisting_force", "load_change"),
        voltage_share: ("current_sag", "supply_drop"),
        history_after_supply: ("kept_after_current",),
    }
    return {getattr(one, "__name__"): one for one, names in made.items() if old.keys() & set(names)}  # noqa: B009
