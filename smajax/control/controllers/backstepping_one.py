r"""Backstepping, approach I (Elahinia 2004, sec. 4.8.1), of any moving load: Khalil's procedure through the stress.

No temperature is measured. With $x_1 = \theta - \theta_d$, $x_2 = \dot x_1$ (the source has $\theta_d = 0$), the load's inertia I and
resistance h, alpha = lever A_w (2 r A_w of the arm), K_0 = 1/s^2 in the source:

    Phi   = (I/alpha) (-K_0 x_1 + h/I + theta_d'' - K x_2)   stress that makes x_1'' + K x_1' + K_0 x_1 = 0   (eq. 4.57)
    z_1   = sigma - Phi,      u_1 = -(alpha/I) x_2 - k_1 z_1                                         (eq. 4.58, 4.65)
    x_4'  = (u_1 + dPhi/dt + (lever/l_0) E x_2) / Gamma      rate of the fraction with which z_1' = u_1   (eq. 4.66)
    x_5   = temperature at which the wire has its fraction under its stress                           (eq. 4.67)
    U     = m c_p x_5' + h_c A_c (x_5 - T_inf)                                                       (eq. 4.68)

Eq. 4.66 prints a part of the bracket outside of 1/Gamma; the derivatives of Phi and of eq. 4.67 are automatic.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.control.controllers.approach import approach_speed, braking_parameter
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.inverse_wire import (
    power_for,
    strain_offset,
    stress_slopes,
    temperature_for,
    voltage_for,
)
from smajax.control.controllers.position_integral import next_integral
from smajax.control.load_equation import equation_of, force_per_stress
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.parameters import parameter
from smajax.model.system import System
from smajax.model.types import Scalar


class BacksteppingOneMemory(eqx.Module):
    """For the rate of the stress, and the branch in force."""

    stress: Scalar  # Pa, at the last call
    heating: Scalar  # 1 while martensite is to become austenite, else 0
    integral: Scalar  # rad/s, m/s: of w, the pull back to the set point
    inner_integral: Scalar  # Pa s: of the stress error


class Asked(eqx.Module):
    """What a call works out on its way to the voltage."""

    stress: Scalar  # Pa, Phi
    stress_error: Scalar  # Pa, z_1
    fraction_rate: Scalar  # 1/s, x_4'
    heating: Scalar  # 1 or 0: the curve used
    temperature: Scalar  # C, x_5
    temperature_rate: Scalar  # C/s, x_5'
    power: Scalar  # W/m, U, before it is bounded


class BacksteppingOne(AbstractController):
    """Needs position, rate, stress, its rate (a difference of two calls), the fraction, and the amplitudes xi_M and xi_A.

    The curve changes with the sign of the wanted fraction's rate: there the voltage jumps and has no derivative.
    """

    believed: System
    damping_gain: Scalar = parameter("1/s", 0.0, 1e4, "K: weight of the rate in the stress wanted (eq. 4.57)")
    stress_gain: Scalar = parameter("1/s", 0.0, 1e4, "k_1: how fast the stress error dies out (eq. 4.65)")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero", limits_command=True)
    edge: Scalar = parameter(
        "-", 1e-12, 0.5, "distance from the ends of arccos from where on its slope is held", default=1e-6
    )
    rest_torque_share: Scalar = parameter(
        "-", 0.0, 1.0, "share of h_0 taken off h: 1 as in eq. 4.70, which moves the equilibrium", default=0.0
    )
    position_gain: Scalar = parameter(
        "1/s^2", 0.0, 1e4, "weight of the error in the stress wanted: 1 as eq. 4.57 prints", default=1.0
    )
    integral_rate: Scalar = parameter(
        "1/s", 0.0, 1e3, "1/T_i: weight of the integral of the pull beside the pull itself; 0 as printed", default=0.0
    )
    measured_rate_share: Scalar = parameter(
        "-", 0.0, 1.0, "1: the stress's rate as measured (sec. 4.8.2); 0: the rate that is wanted", default=1.0
    )
    stress_integral_rate: Scalar = parameter(
        "1/s",
        0.0,
        1e3,
        "1/T_z: weight of the integral of the stress error beside that error; 0 as printed",
        default=0.0,
    )
    braking: Scalar = braking_parameter()

    # The wire read backwards from the measured state (`inverse_wire.strain_offset`), for laws other than eq. 4.51.
    anchored: bool = eqx.field(static=True, default=False)

    def start(self, measured: MeasuredState, wanted: Reference) -> BacksteppingOneMemory:
        return BacksteppingOneMemory(
            measured.stress,
            jnp.ones_like(measured.stress),
            jnp.zeros_like(measured.position),
            jnp.zeros_like(measured.stress),
        )

    def stress_wanted(
        self, position: Scalar, velocity: Scalar, wanted: Reference, integral: Scalar | float = 0.0
    ) -> Scalar:
        """Phi of eq. 4.57, Pa; never negative: a wire cannot push."""
        equation, inertia = equation_of(self.believed), self._inertia()
        torque = equation.resistance(position, velocity) - self.rest_torque_share * equation.resistance(
            wanted.position, jnp.zeros_like(velocity)
        )
        pull = self._pull(position, velocity, wanted) + self.integral_rate * integral
        torque = torque + inertia * (wanted.acceleration - pull)
        stress = torque / force_per_stress(self.believed)
        return jnp.where(stress < 0.0, 0.0, stress)  # so that nan stays nan

    def asked(self, memory: BacksteppingOneMemory, measured: MeasuredState, wanted: Reference, period: Scalar) -> Asked:
        """From the state to the power."""
        believed, law = self.believed, self.believed.wire.kinetics
        push = force_per_stress(believed) / self._inertia()
        resisting = equation_of(believed).resistance(measured.position, measured.velocity) / self._inertia()
        acceleration = push * measured.stress - resisting
        moving = Reference(wanted.velocity, wanted.acceleration, jnp.zeros_like(wanted.acceleration))
        stress, stress_wanted_rate = jax.jvp(
            self.stress_wanted,
            (measured.position, measured.velocity, wanted, memory.integral),
            (measured.velocity, acceleration, moving, self._pull(measured.position, measured.velocity, wanted)),
        )
        error = measured.stress - stress
        # In pascals and radians the first term is next to nothing; it is there for the Lyapunov function of eq. 4.64.
        pull = -push * (measured.velocity - wanted.velocity) - self.stress_gain * (
            error + self.stress_integral_rate * memory.inner_integral
        )
        stress_rate = pull + stress_wanted_rate
        offset = strain_offset(believed, measured) if self.anchored else 0.0
        per_fraction, per_radian = stress_slopes(believed, measured.position, measured.martensite_fraction, offset)
        fraction_rate = (stress_rate - per_radian * measured.velocity) / per_fraction
        heating = (fraction_rate < 0.0) | ((fraction_rate == 0.0) & (memory.heating > 0.5))
        seen = (measured.stress - memory.stress) / period
        share = self.measured_rate_share
        temperature, rate = jax.jvp(
            lambda fraction, stress: temperature_for(
                law, fraction, stress, heating, measured.xi_M, measured.xi_A, self.edge
            ),
            (measured.martensite_fraction, measured.stress),
            (fraction_rate, share * seen + (1.0 - share) * stress_rate),
        )
        power = power_for(believed, temperature, rate)
        return Asked(stress, error, fraction_rate, 1.0 * heating, temperature, rate, power)

    def step(
        self, memory: BacksteppingOneMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[BacksteppingOneMemory, Scalar]:
        unlimited = self.asked(memory, measured, wanted, period)
        voltage = voltage_for(
            self.believed, unlimited.power, unlimited.temperature, measured.martensite_fraction, self.largest_voltage
        )
        pull = self._pull(measured.position, measured.velocity, wanted)
        integral = next_integral(memory.integral, pull, period, voltage, self.largest_voltage)
        inner = next_integral(memory.inner_integral, unlimited.stress_error, period, voltage, self.largest_voltage)
        return BacksteppingOneMemory(measured.stress, unlimited.heating, integral, inner), voltage

    def _inertia(self) -> Scalar:
        return equation_of(self.believed).inertia()

    def _pull(self, position: Scalar, velocity: Scalar, wanted: Reference) -> Scalar:
        """w = K (x_2 + f(x_1)), rad/s^2, which the integral sums up: K_0 x_1 + K x_2 as printed where f is a line (`approach`)."""
        off, off_rate = position - wanted.position, velocity - wanted.velocity
        damped = self.damping_gain > 0.0
        gain = jnp.where(damped, self.damping_gain, 1.0)
        towards = gain * approach_speed(off, self.position_gain / gain, self.braking)
        return jnp.where(damped, towards, self.position_gain * off) + self.damping_gain * off_rate
