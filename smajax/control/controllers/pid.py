r"""PID control of the position (Elahinia 2004, sec. 4.3; the source prints neither its form nor its gains).

    u = K_p e + I + K_d (dtheta_d/dt - v),      e = theta_d - theta,      dI/dt = K_i e + (sat(u) - u)/T_t

v is the filtered difference of the position, so a set point that jumps gives no kick. The voltage that holds the arm
is found by I; no bias is needed.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.rate import Rate, at_rest, filtered_rate
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class PidMemory(eqx.Module):
    """What the controller remembers."""

    integral: Scalar  # V
    motion: Rate  # rad, rad/s


class Pid(AbstractController):
    """Reads the position only.

    Against windup by back-calculation, not by holding the integral in saturation: the integral is then a continuous
    function of the gains, and a search along derivatives goes through saturation. It needs one time more.
    """

    proportional_gain: Scalar = parameter("V/rad", 0.0, 1e6, "K_p")
    integral_gain: Scalar = parameter("V/(rad s)", 0.0, 1e6, "K_i")
    derivative_gain: Scalar = parameter("V s/rad", 0.0, 1e6, "K_d")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "upper limit of the command", limits_command=True)
    smallest_voltage: Scalar = parameter("V", -1e4, 1e4, "lower limit; a heater takes none below zero", default=0.0)
    rate_filter: Scalar = parameter("s", 0.0, 10.0, "time constant of the derivative's filter", default=0.02)
    unwinding_time: Scalar = parameter("s", 0.0, 1e9, "T_t: time in which saturation unwinds the integral", default=1.0)

    def start(self, measured: MeasuredState, wanted: Reference) -> PidMemory:
        return PidMemory(jnp.zeros_like(measured.position), at_rest(measured.position))

    def step(
        self, memory: PidMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[PidMemory, Scalar]:
        error = wanted.position - measured.position
        motion = filtered_rate(memory.motion, measured.position, self.rate_filter, period)
        damping = self.derivative_gain * (wanted.velocity - motion.rate)
        unlimited = self.proportional_gain * error + memory.integral + damping
        voltage = limited(unlimited, self.smallest_voltage, self.largest_voltage)
        # Backward Euler in the unwinding: stable for every T_t.
        unwound = (voltage - unlimited) * period / (self.unwinding_time + period)
        return PidMemory(memory.integral + period * self.integral_gain * error + unwound, motion), voltage
