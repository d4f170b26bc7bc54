"""An effect: a missing piece of physics with coefficients, in the equations whose contracts it inherits from.

An effect is an immutable module whose coefficients are `parameter` fields; the default of each is its base value. With
its switches at their base value (zero) every method must return exactly what the base model has, so that the extended
model contains the base model. What it may change is said beside each equation, by a class of one to three methods:

| equation | contract |
|---|---|
| heat balance | `wire.heat.HeatTerm` |
| resistance | `wire.resistance.ResistanceTerm` |
| kinetics | `wire.kinetics_terms.ShapeTerm`, `RangeTerm`, `PopulationTerm` |
| constitutive law | `wire.constitutive.ConstitutiveTerm` |
| any of these, where the path matters | `wire.history.HistoryTerm` |
| motion | `load.force.ForceTerm`, `load.friction.FrictionTerm`, `load.mounting.MountingTerm` |
| drive and supply | `drive.inputs.CommandTerm`, `drive.supply.SeriesTerm`, `SupplyTerm` |
| sensor | `sensor_reading.SensorTerm`, `SensorLagTerm` |
| recorded input | `drive.inputs.InputLagTerm` |

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


# Names of version 0.1 -> where they are now; until version 0.3.
_MOVED = {"Extent": "smajax.model.effects.candidate", "PRESLIDING": "smajax.model.load.friction"}


def __getattr__(name: str) -> Any:
    if name not in _MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    message = f"{__name__}.{name} is {_MOVED[name]}.{name} now; the old path is removed in version 0.3"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return getattr(import_module(_MOVED[name]), name)
