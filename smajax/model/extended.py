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
