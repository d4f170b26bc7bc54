"""The effects of a system by the equation that accepts them: each equation has a contract beside it, a class of one to three methods.

An effect belongs to every contract that it inherits from. The grouping is made of types alone; nothing of it is traced.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

from smajax.model.drive.inputs import CommandTerm, InputLagTerm
from smajax.model.drive.supply import SeriesTerm, SupplyTerm, SupplyTerms
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.contract_check import contract_fault
from smajax.model.effects.old_contract import adopt
from smajax.model.load.force import ForceTerm
from smajax.model.load.friction import FrictionTerm
from smajax.model.load.mounting import MountingTerm
from smajax.model.sensor_reading import SensorLagTerm, SensorTerm, SensorTerms
from smajax.model.wire.constitutive import ConstitutiveTerm, ConstitutiveTerms
from smajax.model.wire.heat import HeatTerm
from smajax.model.wire.history import HistoryTerm
from smajax.model.wire.kinetics_terms import KineticsTerms, PlaceTerm, PopulationTerm, RangeTerm, ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm


class Terms(NamedTuple):
    """What the effects of one system change, by equation, in the order of the effects."""

    heat: tuple[HeatTerm, ...] = ()
    resistance: tuple[ResistanceTerm, ...] = ()
    kinetics: KineticsTerms = KineticsTerms()
    constitutive: ConstitutiveTerms = ConstitutiveTerms()
    history: tuple[HistoryTerm, ...] = ()
    force: tuple[ForceTerm, ...] = ()
    friction: tuple[FrictionTerm, ...] = ()
    mounting: tuple[MountingTerm, ...] = ()
    supply: SupplyTerms = SupplyTerms()
    sensor: SensorTerms = SensorTerms()
    input_lag: tuple[InputLagTerm, ...] = ()


@cache
def _fault(effect: Any) -> str:
    if not issubclass(effect, AbstractEffect):
        return "is no effect: expected a class that inherits from AbstractEffect and from the contract of an equation"
    adopt(effect)
    return contract_fault(effect)


def check_effects(effects: Sequence[AbstractEffect]) -> None:
    """Raise TypeError for an effect that no equation would accept: it would be ignored without a word."""
    for effect in effects:
        if isinstance(effect, type):
            raise TypeError(
                f"{effect.__name__} in the effects of a system is a class; expected an instance: {effect.__name__}(...)."
            )
        kind: Any = type(effect)
        if fault := _fault(kind):
            raise TypeError(f"{kind.__name__} {fault} (docs/how-to/add-an-effect.md).")


def grouped(effects: Sequence[AbstractEffect]) -> Terms:
    """`effects` by contract."""
    for effect in effects:
        adopt(type(effect))
    history = tuple(one for one in effects if isinstance(one, HistoryTerm))
    return Terms(
        heat=tuple(one for one in effects if isinstance(one, HeatTerm)),
        resistance=tuple(one for one in effects if isinstance(one, ResistanceTerm)),
        kinetics=KineticsTerms(
            shapes=tuple(one for one in effects if isinstance(one, ShapeTerm)),
            places=tuple(one for one in effects if isinstance(one, PlaceTerm)),
            ranges=tuple(one for one in effects if isinstance(one, RangeTerm)),
            populations=tuple(one for one in effects if isinstance(one, PopulationTerm)),
        ),
        constitutive=ConstitutiveTerms(tuple(one for one in effects if isinstance(one, ConstitutiveTerm)), history),
        history=history,
        force=tuple(one for one in effects if isinstance(one, ForceTerm)),
        friction=tuple(one for one in effects if isinstance(one, FrictionTerm)),
        mounting=tuple(one for one in effects if isinstance(one, MountingTerm)),
        supply=SupplyTerms(
            commands=tuple(one for one in effects if isinstance(one, CommandTerm)),
            series=tuple(one for one in effects if isinstance(one, SeriesTerm)),
            supplies=tuple(one for one in effects if isinstance(one, SupplyTerm)),
        ),
        sensor=SensorTerms(
            lags=tuple(one for one in effects if isinstance(one, SensorLagTerm)),
            readings=tuple(one for one in effects if isinstance(one, SensorTerm)),
        ),
        input_lag=tuple(one for one in effects if isinstance(one, InputLagTerm)),
    )
