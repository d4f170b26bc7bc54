"""Voltage on the wire through an amplifier."""

from __future__ import annotations

from typing import ClassVar

from smajax.drive.base import AbstractDrive
from smajax.parameters import parameter
from smajax.types import Inputs, Scalar


class Voltage(AbstractDrive):
    r"""$I = g V / (R l_0)$, so $I^2 R = (g V / l_0)^2 / R$ per metre.

    Eq. 4.28 prints V^2/R with the R of one metre; that is a gain of l_0 here, and the amplifier's comes on top.
    """

    amplifier_gain: Scalar = parameter("-", 1e-3, 1e3, "gain between the voltage channel and the wire")

    inputs_required: ClassVar[frozenset[str]] = frozenset({"voltage"})
    inputs_squared: ClassVar[frozenset[str]] = inputs_required

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return (self.amplifier_gain * inputs["voltage"] / length) ** 2 / resistance
