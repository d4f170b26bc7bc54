"""The library of candidate effects: one file and one line here each, and what other packages bring."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from smajax.core.names import close_matches
from smajax.core.plugins import EFFECTS, brought
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import EQUATIONS, ORIGINS, PRIOR_CLASSES, SCALES
from smajax.model.effects.contract_check import contract_fault
from smajax.model.effects.old_contract import adopt

# A line each: the file in this folder, which has the effect of the same name. What was recorded comes before what the drive
# makes of it, and of two effects on one shape the first acts first.
_NAMES = (
    "input_level",
    "input_delay",
    "input_clock",
    "latent_heat",
    "rising_convection",
    "free_convection",
    "radiation",
    "ambient_drift",
    "draught",
    "warmed_surroundings",
    "phase_specific_heat",
    "end_conduction",
    "phase_resistance",
    "temperature_resistance",
    "lead_resistance",
    "supply_sag",
    "supply_memory",
    "dead_zone",
    "amplifier_saturation",
    "pwm_smoothing",
    "pulsed_voltage",
    "transformation_curve",
    "smooth_transformation",
    "asymmetric_transformation",
    "two_part_transformation",
    "two_step_transformation",
    "enhanced_conditions",
    "liang_conditions",
    "unequal_stress_slopes",
    "stress_dependent_width",
    "minor_loops",
    "lagging_transformation",
    "drifting_temperatures",
    "phase_modulus",
    "elastic_mismatch",
    "thermal_expansion",
    "stress_dependent_strain",
    "two_way_memory",
    "residual_strain",
    "creep",
    "coulomb_friction",
    "pulley_friction",
    "stribeck_friction",
    "pulley_stribeck_friction",
    "viscous_friction",
    "series_compliance",
    "slack",
    "loose_start",
    "nonlinear_spring",
    "wrong_load",
    "load_shift",
    "sensor_lag",
    "sensor_gain",
    "sensor_drift",
    "sensor_offset",
    "sensor_backlash",
    "sensor_limit",
    "sensor_resolution",
)


def _wrong(name: str, effect: Any) -> str:
    """What keeps a class, of ours or of another package, from being an effect of that name."""
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
        if width.of not in SCALES or width.above not in ORIGINS or not width.sigma > 0.0:
            return (
                f"has {width!r} for {coefficient}; expected a sigma above 0, `of` one of {', '.join(map(repr, SCALES))}, "
                f"and `above` one of {', '.join(map(repr, ORIGINS))}"
            )
    return contract_fault(effect)


def _effect_of(name: str) -> type[AbstractEffect]:
    """The class with that `effect_name` in the file of that name. Raises LookupError where it has none, TypeError for one that is not complete."""
    module = import_module(f"smajax.model.effects.{name}")
    for one in vars(module).values():
        if isinstance(one, type) and issubclass(one, AbstractEffect) and getattr(one, "effect_name", "") == name:
            if fault := _wrong(name, one):
                raise TypeError(f"the effect in smajax/model/effects/{name}.py {fault}.")
            return one
    raise LookupError(
        f"smajax/model/effects/{name}.py has no class with `effect_name = {name!r}`; give its effect that name."
    )


_OWN: dict[str, type[AbstractEffect]] = {name: _effect_of(name) for name in _NAMES}


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
