"""The library of candidate effects: one file and one line here each, and what other packages bring."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from smajax.core.names import close_matches
from smajax.core.plugins import EFFECTS, brought
from smajax.model.effects.ambient_drift import AmbientDrift
from smajax.model.effects.asymmetric_transformation import AsymmetricTransformation
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import EQUATIONS, PRIOR_CLASSES, SCALES
from smajax.model.effects.contracts import CONTRACTS, methods
from smajax.model.effects.coulomb_friction import CoulombFriction
from smajax.model.effects.creep import Creep
from smajax.model.effects.dead_zone import DeadZone
from smajax.model.effects.draught import Draught
from smajax.model.effects.drifting_temperatures import DriftingTemperatures
from smajax.model.effects.end_conduction import EndConduction
from smajax.model.effects.enhanced_conditions import EnhancedConditions
from smajax.model.effects.input_clock import InputClock
from smajax.model.effects.input_delay import InputDelay
from smajax.model.effects.input_level import InputLevel
from smajax.model.effects.lagging_transformation import LaggingTransformation
from smajax.model.effects.latent_heat import LatentHeat
from smajax.model.effects.lead_resistance import LeadResistance
from smajax.model.effects.liang_conditions import LiangConditions
from smajax.model.effects.load_shift import LoadShift
from smajax.model.effects.loose_start import LooseStart
from smajax.model.effects.minor_loops import MinorLoops
from smajax.model.effects.nonlinear_spring import NonlinearSpring
from smajax.model.effects.old_contract import adopt
from smajax.model.effects.phase_modulus import PhaseModulus
from smajax.model.effects.phase_resistance import PhaseResistance
from smajax.model.effects.phase_specific_heat import PhaseSpecificHeat
from smajax.model.effects.pulley_friction import PulleyFriction
from smajax.model.effects.pulley_stribeck_friction import PulleyStribeckFriction
from smajax.model.effects.pulsed_voltage import PulsedVoltage
from smajax.model.effects.pwm_smoothing import PwmSmoothing
from smajax.model.effects.radiation import Radiation
from smajax.model.effects.residual_strain import ResidualStrain
from smajax.model.effects.rising_convection import RisingConvection
from smajax.model.effects.sensor_backlash import SensorBacklash
from smajax.model.effects.sensor_drift import SensorDrift
from smajax.model.effects.sensor_gain import SensorGain
from smajax.model.effects.sensor_lag import SensorLag
from smajax.model.effects.sensor_offset import SensorOffset
from smajax.model.effects.sensor_resolution import SensorResolution
from smajax.model.effects.series_compliance import SeriesCompliance
from smajax.model.effects.slack import Slack
from smajax.model.effects.smooth_transformation import SmoothTransformation
from smajax.model.effects.stress_dependent_strain import StressDependentStrain
from smajax.model.effects.stress_dependent_width import StressDependentWidth
from smajax.model.effects.stribeck_friction import StribeckFriction
from smajax.model.effects.supply_memory import SupplyMemory
from smajax.model.effects.supply_sag import SupplySag
from smajax.model.effects.temperature_resistance import TemperatureResistance
from smajax.model.effects.thermal_expansion import ThermalExpansion
from smajax.model.effects.two_part_transformation import TwoPartTransformation
from smajax.model.effects.two_step_transformation import TwoStepTransformation
from smajax.model.effects.two_way_memory import TwoWayMemory
from smajax.model.effects.unequal_stress_slopes import UnequalStressSlopes
from smajax.model.effects.viscous_friction import ViscousFriction
from smajax.model.effects.wrong_load import WrongLoad

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
    adopt(effect)
    missing = [one for one in AbstractEffect.__annotations__ if not hasattr(effect, one)]
    if missing:
        return f"lacks {', '.join(missing)}, which every effect says of itself"
    candidate = effect.candidate
    if effect.effect_name != name:
        return f"calls itself {effect.effect_name!r}: give the entry point and the effect the same name"
    if candidate.equation not in EQUATIONS:
        return f"is in the equation {candidate.equation!r}; expected one of {', '.join(EQUATIONS)}"
    if candidate.prior_class not in PRIOR_CLASSES:
        return f"is of the class {candidate.prior_class!r}; expected one of {', '.join(PRIOR_CLASSES)}"
    fields = [field.name for field in dataclasses.fields(effect)]
    given = (
        ("switches", candidate.switches),
        ("an initial guess", tuple(candidate.initial_guess)),
        ("a width", tuple(candidate.widths)),
    )
    for which, named in given:
        strange = [one for one in named if one not in fields]
        if strange:
            return f"has {which} of what is none of its parameters: {', '.join(strange)}; these are {', '.join(fields)}"
    for coefficient, width in candidate.widths.items():
        if width.of not in SCALES or not width.sigma > 0.0:
            return f"has {width!r} for {coefficient}; expected a sigma above 0, and `of` one of {', '.join(map(repr, SCALES))}"
    accepted = [contract for contract in CONTRACTS if issubclass(effect, contract)]
    if not accepted:
        return f"changes no equation: it inherits from none of {', '.join(one.__name__ for one in CONTRACTS)}"
    terms = [one for contract in accepted for one in methods(contract)]
    if all(getattr(effect, one) is getattr(contract, one) for contract in accepted for one in methods(contract)):
        return f"changes no equation: it has none of the methods {', '.join(terms)}; is one misspelt?"
    abstract: frozenset[str] = getattr(effect, "__abstractmethods__", frozenset())
    if abstract:
        return f"lacks the methods {', '.join(sorted(abstract))} of its contract"
    return ""


# Ours, then those of other packages (`smajax.core.plugins`), in the order of their names.
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
        raise KeyError(f"No effect `{unknown[0]}`{close_matches(unknown[0], sorted(LIBRARY), 'the library has')}.")
    return tuple(effect.base() for name, effect in LIBRARY.items() if name in names)
