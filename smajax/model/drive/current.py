"""A current source."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class Current(AbstractDrive):
    r"""$I^2 R$ per metre (Elahinia 2004, eq. 3.1): with R(xi) the power falls as the wire turns to the phase of less R."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"current"})
    inputs_squared: ClassVar[frozenset[str]] = inputs_required
    command: ClassVar[tuple[str, str]] = ("current", "A")

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return inputs["current"] ** 2 * resistance

    def drawn_current(self, resistance: Scalar, inputs: Inputs) -> Scalar:
        return jnp.abs(inputs["current"])

    def from_command(self, command: Scalar) -> Inputs:
        return {"current": command}
