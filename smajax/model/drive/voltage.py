"""Voltage on the wire through an amplifier with limits."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class Voltage(AbstractDrive):
    r"""$I = g V / (R l_0)$, so $I^2 R = (g V / l_0)^2 / R$ per metre.

    Eq. 4.28 prints V^2/R with the R of one metre; that is a gain of l_0 here, and the amplifier's comes on top. Beyond
    the amplifier's limit the wire gets the limit, and the derivative with respect to V is zero.
    """

    amplifier_gain: Scalar = parameter("-", 1e-3, 1e3, "gain between the voltage channel and the wire")
    amplifier_limit: Scalar = parameter("V", 1e-3, 1e5, "largest voltage that the amplifier puts on the wire")

    inputs_required: ClassVar[frozenset[str]] = frozenset({"voltage"})
    inputs_squared: ClassVar[frozenset[str]] = inputs_required

    def _put(self, inputs: Inputs) -> Scalar:
        """Voltage at the amplifier's terminals, V."""
        request = jnp.abs(self.amplifier_gain * inputs["voltage"])
        return jnp.where(request >= self.amplifier_limit, self.amplifier_limit, request)

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return (self._put(inputs) / length) ** 2 / resistance

    def wire_share(self, own: Scalar, series: Scalar | float) -> Scalar:
        return (own / (own + series)) ** 2

    def drawn_current(self, resistance: Scalar, inputs: Inputs) -> Scalar:
        return self._put(inputs) / resistance

    def largest_command(self) -> Scalar:
        return self.amplifier_limit / self.amplifier_gain

    def from_voltage(self, voltage: Scalar) -> Inputs:
        return {"voltage": voltage}
