"""Pulse-width modulation of a fixed supply, averaged over its period."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class Duty(AbstractDrive):
    """Mean power = duty * V_s^2 / (R l_0^2) per metre: the wire is far slower than the modulation."""

    supply_voltage: Scalar = parameter("V", 0.1, 1e3, "voltage of the supply while the switch is closed")

    inputs_required: ClassVar[frozenset[str]] = frozenset({"duty"})

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return inputs["duty"] * (self.supply_voltage / length) ** 2 / resistance

    def wire_share(self, own: Scalar, series: Scalar | float) -> Scalar:
        return (own / (own + series)) ** 2

    def drawn_current(self, resistance: Scalar, inputs: Inputs) -> Scalar:
        return self.supply_voltage / resistance

    def largest_command(self) -> Scalar:
        return self.supply_voltage

    def from_voltage(self, voltage: Scalar) -> Inputs:
        """The duty that heats as `voltage` would; all of the supply is the most there is."""
        duty = (voltage / self.supply_voltage) ** 2
        return {"duty": jnp.where(duty > 1.0, 1.0, duty)}
