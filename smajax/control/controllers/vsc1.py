"""VSC1: a switch between two voltages on the sign of the position error (Elahinia 2004, eq. 4.4)."""

from __future__ import annotations

import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class Vsc1(AbstractController):
    r"""$s = \theta - \theta_d$; V_high where s < 0, else V_low.

    It has no useful derivative in its gains: they move the switching times, which are whole control periods.
    """

    high_voltage: Scalar = parameter("V", 0.0, 1e4, "V_high: short of the set point", limits_command=True)
    low_voltage: Scalar = parameter("V", 0.0, 1e4, "V_low: beyond it")

    def start(self, measured: MeasuredState, wanted: Reference) -> tuple[()]:
        return ()

    def step(
        self, memory: tuple[()], measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[tuple[()], Scalar]:
        surface = measured.position - wanted.position
        # A position that is no number must not read as `beyond the set point`: the run is then flagged.
        known = jnp.where(jnp.isfinite(surface), 0.0, jnp.nan)
        return memory, jnp.where(surface < 0.0, self.high_voltage, self.low_voltage) + known
