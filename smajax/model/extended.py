"""From a list of effects to the model extended by them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from smajax.core.parameters import set_parameters
from smajax.model.effects.library import at_base
from smajax.model.system import System


def extended(system: System, effects: Sequence[str], coefficients: Mapping[str, float] | None = None) -> System:
    """`system` with the named effects in its equations, at base value or with `coefficients` (`latent_heat.enthalpy`).

    At base value the simulated trajectory is that of `system`.
    """
    return set_parameters(dataclasses.replace(system, effects=at_base(effects)), dict(coefficients or {}))


def without_input_lag(system: System) -> System:
    """`system`, or a stack of systems, without the effects that shift a recorded input in time: they are of a log, and a closed loop has none."""
    late = {one.effect_name for one in system.terms.input_lag}
    if not late:
        return system
    return dataclasses.replace(system, effects=tuple(one for one in system.effects if one.effect_name not in late))


def with_effects(system: System, names: Sequence[str]) -> System:
    """`system` with further effects at base value, all in the library's order; the values of those that it has stay."""
    there = [one.effect_name for one in system.effects]
    if not set(names) - set(there):
        return system
    own = dict(zip(there, system.effects, strict=True))
    both = (own.get(one.effect_name, one) for one in at_base([*there, *names]))
    return dataclasses.replace(system, effects=tuple(both))
