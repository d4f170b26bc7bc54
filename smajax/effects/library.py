"""The library of candidate effects: one file and one line here each."""

from __future__ import annotations

from collections.abc import Sequence

from smajax.effects.ambient_drift import AmbientDrift
from smajax.effects.asymmetric_transformation import AsymmetricTransformation
from smajax.effects.base import AbstractEffect
from smajax.effects.coulomb_friction import CoulombFriction
from smajax.effects.creep import Creep
from smajax.effects.drifting_temperatures import DriftingTemperatures
from smajax.effects.enhanced_conditions import EnhancedConditions
from smajax.effects.lagging_transformation import LaggingTransformation
from smajax.effects.latent_heat import LatentHeat
from smajax.effects.minor_loops import MinorLoops
from smajax.effects.phase_resistance import PhaseResistance
from smajax.effects.radiation import Radiation
from smajax.effects.residual_strain import ResidualStrain
from smajax.effects.rising_convection import RisingConvection
from smajax.effects.sensor_backlash import SensorBacklash
from smajax.effects.sensor_drift import SensorDrift
from smajax.effects.sensor_gain import SensorGain
from smajax.effects.sensor_lag import SensorLag
from smajax.effects.sensor_offset import SensorOffset
from smajax.effects.smooth_transformation import SmoothTransformation
from smajax.effects.stress_dependent_strain import StressDependentStrain
from smajax.effects.stress_dependent_width import StressDependentWidth
from smajax.effects.thermal_expansion import ThermalExpansion
from smajax.effects.two_part_transformation import TwoPartTransformation
from smajax.effects.two_way_memory import TwoWayMemory
from smajax.effects.unequal_stress_slopes import UnequalStressSlopes

LIBRARY: dict[str, type[AbstractEffect]] = {
    effect.effect_name: effect
    for effect in (
        LatentHeat,
        RisingConvection,
        Radiation,
        AmbientDrift,
        PhaseResistance,
        SmoothTransformation,
        AsymmetricTransformation,
        TwoPartTransformation,
        EnhancedConditions,
        UnequalStressSlopes,
        StressDependentWidth,
        MinorLoops,
        LaggingTransformation,
        DriftingTemperatures,
        ThermalExpansion,
        StressDependentStrain,
        TwoWayMemory,
        ResidualStrain,
        Creep,
        CoulombFriction,
        SensorLag,
        SensorGain,
        SensorDrift,
        SensorOffset,
        SensorBacklash,
    )
}


def at_base(names: Sequence[str]) -> tuple[AbstractEffect, ...]:
    """The named effects, present and changing nothing, in the library's order whatever the order of `names`.

    Two effects on one shape do not commute: the order must not be a matter of who was found first. Raises KeyError,
    listing the library, for an unknown name.
    """
    unknown = [name for name in names if name not in LIBRARY]
    if unknown:
        raise KeyError(f"No effect named {unknown} in the library; it has {sorted(LIBRARY)}.")
    return tuple(effect.base() for name, effect in LIBRARY.items() if name in names)
