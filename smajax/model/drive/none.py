"""No drive: an oven or a bath sets the temperature, or the wire just cools."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class NoDrive(AbstractDrive):
    """Zero power."""

    inputs_required: ClassVar[frozenset[str]] = frozenset()

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return jnp.zeros_like(resistance)
