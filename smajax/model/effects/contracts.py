"""Every contract of an equation in one list, for what has to look through them all."""

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
from smajax.model.wire.kinetics_terms import PopulationTerm, RangeTerm, ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm

CONTRACTS: tuple[abc.ABCMeta, ...] = (
    HeatTerm,
    ResistanceTerm,
    ShapeTerm,
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
