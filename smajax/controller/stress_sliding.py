r"""Stress-based sliding control (Elahinia 2004, sec. 4.7): position error -> stress wanted -> voltage.

With $e = \theta - \theta_d$ and $s = \dot e + \lambda e$ (the source writes the error the other way round in eq. 4.42 and
the derivative for this one in eq. 4.44), a set point that rests and eq. 3.8,

    tau_w = tau_g + tau_s + c theta' - I lambda e' - K sat(s / phi),      sigma_d = tau_w / (2 r A_w)    (eq. 4.44, 4.45)

and a PID controller on the stress sets the voltage.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.controller.base import AbstractController
from smajax.load.arm import Arm
from smajax.parameters import parameter
from smajax.types import Inputs, Scalar, State


class StressSlidingMemory(eqx.Module):
    """Of the inner PID controller."""

    integral: Scalar  # Pa s
    error: Scalar  # Pa, at the last call


class StressSliding(AbstractController):
    """Outer sliding surface on the angle, inner PID on the stress; `arm` is the arm that the controller believes in."""

    arm: Arm
    cross_section: Scalar = parameter("m^2", 1e-10, 1e-4, "A_w that the controller believes in")
    surface_slope: Scalar = parameter("1/s", 0.0, 1e3, "lambda: how fast the error dies out on the surface")
    gain: Scalar = parameter("N m", 0.0, 1e3, "K: torque added against the distance from the surface")
    boundary: Scalar = parameter("rad/s", 1e-6, 1e3, "phi: distance from the surface at which the torque saturates")
    stress_gain: Scalar = parameter("V/Pa", 0.0, 1.0, "proportional gain of the stress controller")
    stress_integral_gain: Scalar = parameter("V/(Pa s)", 0.0, 1.0, "integral gain")
    stress_derivative_gain: Scalar = parameter("V s/Pa", 0.0, 1.0, "derivative gain")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero")

    def start(self, state: State, target: Scalar) -> StressSlidingMemory:
        zero = jnp.zeros_like(state.wire.stress)
        return StressSlidingMemory(zero, self.stress_wanted(state, target) - state.wire.stress)

    def stress_wanted(self, state: State, target: Scalar) -> Scalar:
        """sigma_d, Pa (eq. 4.44, 4.45); never negative: a wire cannot push."""
        error, rate = state.motion.position - target, state.motion.velocity
        surface = (rate + self.surface_slope * error) / self.boundary
        saturated = jnp.where(surface > 1.0, 1.0, jnp.where(surface < -1.0, -1.0, surface))
        torque = self.arm.resistance(state.motion.position, rate, {})
        torque = torque - self.arm.inertia({}) * self.surface_slope * rate - self.gain * saturated
        wanted = torque / (self.arm.lever() * self.cross_section)
        return jnp.where(wanted > 0.0, wanted, 0.0)

    def command(
        self, memory: StressSlidingMemory, state: State, target: Scalar, period: Scalar
    ) -> tuple[Inputs, StressSlidingMemory]:
        error = self.stress_wanted(state, target) - state.wire.stress
        integral = memory.integral + period * error
        rate = (error - memory.error) / period
        asked = self.stress_gain * error + self.stress_integral_gain * integral + self.stress_derivative_gain * rate
        voltage = jnp.where(asked < 0.0, 0.0, jnp.where(asked > self.largest_voltage, self.largest_voltage, asked))
        # Conditional integration: what the amplifier cannot give is not summed up.
        integral = jnp.where(voltage == asked, integral, memory.integral)
        return {"voltage": voltage}, StressSlidingMemory(integral, error)
