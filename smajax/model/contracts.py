"""The contracts of the equations, in one place: what an effect inherits from beside `AbstractEffect`, one for each equation that it changes.

`smajax.model.effects.base` lists which equation each is of. Each stands beside its equation; these are the same classes.
"""

from __future__ import annotations

from smajax.model.drive.inputs import CommandTerm as CommandTerm
from smajax.model.drive.inputs import InputLagTerm as InputLagTerm
from smajax.model.drive.supply import SeriesTerm as SeriesTerm
from smajax.model.drive.supply import SupplyTerm as SupplyTerm
from smajax.model.load.force import ForceTerm as ForceTerm
from smajax.model.load.friction import FrictionTerm as FrictionTerm
from smajax.model.load.mounting import MountingTerm as MountingTerm
from smajax.model.sensor_reading import SensorLagTerm as SensorLagTerm
from smajax.model.sensor_reading import SensorTerm as SensorTerm
from smajax.model.wire.constitutive import ConstitutiveTerm as ConstitutiveTerm
from smajax.model.wire.heat import HeatTerm as HeatTerm
from smajax.model.wire.history import HistoryTerm as HistoryTerm
from smajax.model.wire.kinetics_terms import PlaceTerm as PlaceTerm
from smajax.model.wire.kinetics_terms import PopulationTerm as PopulationTerm
from smajax.model.wire.kinetics_terms import RangeTerm as RangeTerm
from smajax.model.wire.kinetics_terms import ShapeTerm as ShapeTerm
from smajax.model.wire.resistance import ResistanceTerm as ResistanceTerm
