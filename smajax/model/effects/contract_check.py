"""Whether an effect changes an equation by a contract, and every contract in one list, for what has to look through them all."""

from __future__ import annotations

import abc
from types import FunctionType

from smajax.model.drive.inputs import CommandTerm, InputLagTerm
from smajax.model.drive.supply import SeriesTerm, SupplyTerm
from smajax.model.load.force import ForceTerm
from smajax.model.load.friction import FrictionTerm
from smajax.model.load.mounting import MountingTerm
from smajax.model.sensor_reading import SensorLagTerm, SensorTerm
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import HeatTerm
from smajax.model.wire.history import HistoryTerm
from smajax.model.wire.kinetics_terms import PlaceTerm, PopulationTerm, RangeTerm, ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm

CONTRACTS: tuple[abc.ABCMeta, ...] = (
    HeatTerm,
    ResistanceTerm,
    ShapeTerm,
    PlaceTerm,
    RangeTerm,
    PopulationTerm,
    ConstitutiveTerm,
    HistoryTerm,
    ForceTerm,
    FrictionTerm,
    MountingTerm,
    CommandTerm,
    SeriesTerm,
    SupplyTerm,
    SensorTerm,
    SensorLagTerm,
    InputLagTerm,
)


def methods(contract: type) -> list[str]:
    """The methods of a contract by name."""
    return [name for name in vars(contract) if name[0] != "_" and isinstance(getattr(contract, name), FunctionType)]


def contract_fault(effect: type) -> str:
    """What keeps a class from changing an equation: which contract or which methods are missing; nothing where it does."""
    accepted = [contract for contract in CONTRACTS if issubclass(effect, contract)]
    own = [name for name in vars(effect) if name[0] != "_" and isinstance(vars(effect)[name], FunctionType)]
    if not accepted:
        fitting = [contract for contract in CONTRACTS if set(own) & set(methods(contract))] or CONTRACTS
        choices = "; ".join(f"{one.__name__} ({', '.join(methods(one))})" for one in fitting)
        return f"changes no equation: it inherits from no contract. Inherit from the one of its equation, and override a method: {choices}"
    kept = [name for name in methods(HistoryTerm) if hasattr(effect, name)]
    if kept and HistoryTerm not in accepted:
        return f"has {', '.join(kept)} of HistoryTerm, and does not inherit from it: its entries would be missing in the wire's history"
    abstract: frozenset[str] = getattr(effect, "__abstractmethods__", frozenset())
    if abstract:
        return f"lacks the methods {', '.join(sorted(abstract))} of its contract"
    terms = [(contract, name) for contract in accepted for name in methods(contract)]
    if all(getattr(effect, name) is getattr(contract, name) for contract, name in terms):
        has = f"it has {', '.join(own)}" if own else "it has no method of its own"
        names = ", ".join(name for _, name in terms)
        return f"changes no equation: {has}, and overrides none of the methods {names}; is one misspelt?"
    return ""
