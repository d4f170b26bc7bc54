"""A plant whose parameters differ from those that its controller assumes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp

from smajax.control.mismatch import MISMATCHES
from smajax.core.parameters import get_parameters, set_vector
from smajax.model.system import System
from smajax.model.types import Scalar


class Perturbation(NamedTuple):
    """Which parameters of a plant may differ, each a column of the rows of closed loops."""

    columns: tuple[str, ...]  # names of `mismatches_of`, or of parameters
    parameters: tuple[str, ...]  # one a column
    absolute: bool = False  # the columns are values; else ratios to the assumed ones


OF_ARM = Perturbation(tuple(MISMATCHES), tuple(MISMATCHES.values()))


def perturbed_plant(system: System, values: Mapping[str, Scalar], perturbation: Perturbation = OF_ARM) -> System:
    """The plant whose parameters are `values` (by the names of the columns), or `values` times those of `system`."""
    names = perturbation.parameters
    if not names:
        return system
    column = jnp.stack([values[name] for name in perturbation.columns])
    return set_vector(system, names, column if perturbation.absolute else get_parameters(system, names) * column)
