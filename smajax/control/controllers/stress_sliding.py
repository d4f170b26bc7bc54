r"""Stress-based sliding control (Elahinia 2004, sec. 4.7) of any moving load: position error -> stress wanted -> voltage.

With $e = \theta - \theta_d$ and $s = \dot e + \lambda e$ (the source writes the error the other way round in eq. 4.42 and
the derivative for this one in eq. 4.44) and the load's equation of motion (eq. 3.8 of the arm),

    tau_w = h(theta, theta') + I theta_d'' - I lambda e' - K sat(s / phi),      sigma_d = tau_w / (lever A_w)    (eq. 4.44, 4.45)

with the resistance h, the inertia I and the lever of whatever load it is (of the arm tau_g + tau_s + c theta' and 2 r), and a PID controller on the stress sets the voltage.
With `braking` the surface is s = e' + f(e), a parabola far from the set point (`approach`); the source's is the line f = lambda e.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.control.controllers.approach import approach_speed, braking_parameter
from smajax.control.controllers.base import AbstractController
from smajax.control.load_equation import LoadEquation
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class StressSlidingMemory(eqx.Module):
    """Of the inner PID controller."""

    integral: Scalar  # Pa s
    error: Scalar  # Pa, at the last call


class StressSliding(AbstractController):
    """Outer sliding surface on the position, inner PID on the stress; `equation` is that of the load that it believes in.

    Continuous in its gains, with a derivative but at the edges of the boundary layer and of the voltage.
    """

    equation: LoadEquation
    cross_section: Scalar = parameter("m^2", 1e-10, 1e-4, "A_w that the controller believes in")
    surface_slope: Scalar = parameter("1/s", 0.0, 1e3, "lambda: how fast the error dies out on the surface")
    gain: Scalar = parameter("N m", 0.0, 1e3, "K: torque added against the distance from the surface")
    boundary: Scalar = parameter("rad/s", 1e-6, 1e3, "phi: distance from the surface at which the torque saturates")
    stress_gain: Scalar = parameter("V/Pa", 0.0, 1.0, "proportional gain of the stress controller")
    stress_integral_gain: Scalar = parameter("V/(Pa s)", 0.0, 1.0, "integral gain")
    stress_derivative_gain: Scalar = parameter("V s/Pa", 0.0, 1.0, "derivative gain")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero", limits_command=True)
    braking: Scalar = braking_parameter()

    def start(self, measured: MeasuredState, wanted: Reference) -> StressSlidingMemory:
        zero = jnp.zeros_like(measured.stress)
        return StressSlidingMemory(zero, self.stress_wanted(measured, wanted) - measured.stress)

    def stress_wanted(self, measured: MeasuredState, wanted: Reference) -> Scalar:
        """sigma_d, Pa (eq. 4.44, 4.45); never negative: a wire cannot push."""
        error, rate = measured.position - wanted.position, measured.velocity - wanted.velocity
        towards, change = jax.jvp(lambda off: approach_speed(off, self.surface_slope, self.braking), (error,), (rate,))
        surface = limited((rate + towards) / self.boundary, -1.0, 1.0)
        inertia = self.equation.inertia()
        torque = self.equation.resistance(measured.position, measured.velocity) + inertia * wanted.acceleration
        torque = torque - inertia * change - self.gain * surface
        stress = torque / (self.equation.lever() * self.cross_section)
        return jnp.where(stress < 0.0, 0.0, stress)  # so that nan stays nan

    def step(
        self, memory: StressSlidingMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[StressSlidingMemory, Scalar]:
        error = self.stress_wanted(measured, wanted) - measured.stress
        integral = memory.integral + period * error
        rate = (error - memory.error) / period
        unlimited = self.stress_gain * error + self.stress_integral_gain * integral + self.stress_derivative_gain * rate
        voltage = limited(unlimited, 0.0, self.largest_voltage)
        # Conditional integration: what the amplifier cannot give is not summed up.
        integral = jnp.where(voltage == unlimited, integral, memory.integral)
        return StressSlidingMemory(integral, error), voltage
