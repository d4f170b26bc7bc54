"""The library of candidate effects: one file and one line here each, and what other packages bring."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from types import FunctionType
from typing import Any

from smajax.effects.ambient_drift import AmbientDrift
from smajax.effects.asymmetric_transformation import AsymmetricTransformation
from smajax.effects.base import AbstractEffect
from smajax.effects.coulomb_friction import CoulombFriction
from smajax.effects.creep import Creep
from smajax.effects.dead_zone import DeadZone
from smajax.effects.draught import Draught
from smajax.effects.drifting_temperatures import DriftingTemperatures
from smajax.effects.end_conduction import EndConduction
from smajax.effects.enhanced_conditions import EnhancedConditions
from smajax.effects.input_clock import InputClock
from smajax.effects.input_delay import InputDelay
from smajax.effects.input_level import InputLevel
from smajax.effects.lagging_transformation import LaggingTransformation
from smajax.effects.latent_heat import LatentHeat
from smajax.effects.lead_resistance import LeadResistance
from smajax.effects.liang_conditions import LiangConditions
from smajax.effects.load_shift import LoadShift
from smajax.effects.loose_start import LooseStart
from smajax.effects.minor_loops import MinorLoops
from smajax.effects.nonlinear_spring import NonlinearSpring
from smajax.effects.phase_modulus import PhaseModulus
from smajax.effects.phase_resistance import PhaseResistance
from smajax.effects.phase_specific_heat import PhaseSpecificHeat
from smajax.effects.pulley_friction import PulleyFriction
from smajax.effects.pulley_stribeck_friction import PulleyStribeckFriction
from smajax.effects.pulsed_voltage import PulsedVoltage
from smajax.effects.pwm_smoothing import PwmSmoothing
from smajax.effects.radiation import Radiation
from smajax.effects.residual_strain import ResidualStrain
from smajax.effects.rising_convection import RisingConvection
from smajax.effects.sensor_backlash import SensorBacklash
from smajax.effects.sensor_drift import SensorDrift
from smajax.effects.sensor_gain import SensorGain
from smajax.effects.sensor_lag import SensorLag
from smajax.effects.sensor_offset import SensorOffset
from smajax.effects.sensor_resolution import SensorResolution
from smajax.effects.series_compliance import SeriesCompliance
from smajax.effects.slack import Slack
from smajax.effects.smooth_transformation import SmoothTransformation
from smajax.effects.stress_dependent_strain import StressDependentStrain
from smajax.effects.stress_dependent_width import StressDependentWidth
from smajax.effects.stribeck_friction import StribeckFriction
from smajax.effects.supply_memory import SupplyMemory
from smajax.effects.supply_sag import SupplySag
from smajax.effects.temperature_resistance import TemperatureResistance
from smajax.effects.thermal_expansion import ThermalExpansion
from smajax.effects.two_part_transformation import TwoPartTransformation
from smajax.effects.two_step_transformation import TwoStepTransformation
from smajax.effects.two_way_memory import TwoWayMemory
from smajax.effects.unequal_stress_slopes import UnequalStressSlopes
from smajax.effects.viscous_friction import ViscousFriction
from smajax.effects.wrong_load import WrongLoad
from smajax.measured.names import instead
from smajax.plugins import EFFECTS, brought

EQUATIONS = ("heat", "electrical", "kinetics", "constitutive", "mechanics", "sensor", "input")

_OWN: dict[str, type[AbstractEffect]] = {
    effect.effect_name: effect
    for effect in (
        # What was recorded comes before what the drive makes of it.
        InputLevel,
        InputDelay,
        InputClock,
        LatentHeat,
        RisingConvection,
        Radiation,
        AmbientDrift,
        Draught,
        PhaseSpecificHeat,
        EndConduction,
        PhaseResistance,
        TemperatureResistance,
        LeadResistance,
        SupplySag,
        SupplyMemory,
        DeadZone,
        PwmSmoothing,
        PulsedVoltage,
        SmoothTransformation,
        AsymmetricTransformation,
        TwoPartTransformation,
        TwoStepTransformation,
        EnhancedConditions,
        LiangConditions,
        UnequalStressSlopes,
        StressDependentWidth,
        MinorLoops,
        LaggingTransformation,
        DriftingTemperatures,
        PhaseModulus,
        ThermalExpansion,
        StressDependentStrain,
        TwoWayMemory,
        ResidualStrain,
        Creep,
        CoulombFriction,
        PulleyFriction,
        StribeckFriction,
        PulleyStribeckFriction,
        ViscousFriction,
        SeriesCompliance,
        Slack,
        LooseStart,
        NonlinearSpring,
        WrongLoad,
        LoadShift,
        SensorLag,
        SensorGain,
        SensorDrift,
        SensorOffset,
        SensorBacklash,
        SensorResolution,
    )
}


def _wrong(name: str, effect: Any) -> str:
    """What keeps a class of another package from being an effect of that name."""
    if not (isinstance(effect, type) and issubclass(effect, AbstractEffect)):
        return f"is {effect!r}; expected a class of `smajax.AbstractEffect`"
    lacking = [one for one in AbstractEffect.__annotations__ if not hasattr(effect, one)]
    if lacking:
        return f"lacks {', '.join(lacking)}, which every effect says of itself"
    if effect.effect_name != name:
        return f"calls itself {effect.effect_name!r}: give the entry point and the effect the same name"
    if effect.equation not in EQUATIONS:
        return f"is in the equation {effect.equation!r}; expected one of {', '.join(EQUATIONS)}"
    fields = [field.name for field in dataclasses.fields(effect)]
    for which, named in (("switches", effect.switches), ("starts", tuple(effect.starts))):
        strange = [one for one in named if one not in fields]
        if strange:
            return f"has {which} that are none of its parameters: {', '.join(strange)}; these are {', '.join(fields)}"
    terms = [one for one, what in vars(AbstractEffect).items() if isinstance(what, FunctionType) and one[0] != "_"]
    if all(getattr(effect, one) is getattr(AbstractEffect, one) for one in terms):
        return f"changes no equation: it has none of the methods {', '.join(terms)}; is one misspelt?"
    return ""


# Ours, then those of other packages (`smajax.plugins`), in the order of their names.
LIBRARY: dict[str, type[AbstractEffect]] = {**_OWN, **brought(EFFECTS, _OWN, _wrong)}


def of_others() -> dict[str, type[AbstractEffect]]:
    """The effects that other packages bring, by name."""
    return {name: effect for name, effect in LIBRARY.items() if name not in _OWN}


def at_base(names: Sequence[str]) -> tuple[AbstractEffect, ...]:
    """The named effects, present and changing nothing, in the library's order whatever the order of `names`.

    Two effects on one shape do not commute: the order must not be a matter of who was found first. Raises KeyError,
    listing the library, for an unknown name.
    """
    unknown = [name for name in names if name not in LIBRARY]
    if unknown:
        raise KeyError(f"No effect `{unknown[0]}`{instead(unknown[0], sorted(LIBRARY), 'the library has')}.")
    return tuple(effect.base() for name, effect in LIBRARY.items() if name in names)
