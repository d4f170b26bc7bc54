"""A plant whose parameters differ from those that its controller assumes."""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp

from smajax.control.mismatch import MISMATCHES
from smajax.core.parameters import get_parameters, set_vector
from smajax.model.system import System
from smajax.model.types import Scalar


def perturbed_plant(system: System, ratios: Mapping[str, Scalar]) -> System:
    """The plant whose parameters are `ratios` (by the names of `MISMATCHES`) times those of `system`."""
    names = tuple(MISMATCHES.values())
    factors = jnp.stack([ratios[name] for name in MISMATCHES])
    return set_vector(system, names, get_parameters(system, names) * factors)
