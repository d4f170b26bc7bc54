r"""Backstepping, approach II (Elahinia 2004, sec. 4.8.2), of any moving load: position -> stress -> fraction -> temperature -> voltage.

With $x_1 = \theta - \theta_d$, $x_2 = \dot x_1$ (the source has $\theta_d = 0$), the load's inertia I and resistance h,
alpha = lever A_w (2 r A_w of the arm), K_0 = 1/s^2 in the source:

    x_3 = (I/alpha) (-K_0 x_1 + h/I + theta_d'' - K x_2)   stress that makes x_1'' + K x_1' + K_0 x_1 = 0  (eq. 4.70)
    x_4 = fraction with that stress at this position                                                   (eq. 4.72)
    z   = T - Phi_1(x_3, x_4)                            temperature less the one with that fraction     (eq. 4.73-4.75)
    U   = m c_p (v + dPhi_1/dt) + h_c A_c (T - T_inf),   so that z' = v = -K_1 z                         (eq. 4.77-4.80)

dPhi_1/dt is the automatic derivative along the motion, in the place of the misprinted eq. 4.76 to 4.80.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.inverse_wire import (
    fraction_for,
    power_for,
    strain_offset,
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


class BacksteppingTwoMemory(eqx.Module):
    """The branch in force."""

    heating: Scalar  # 1 while martensite is to become austenite, else 0
    integral: Scalar  # rad/s, m/s: of w, the pull back to the set point
    inner_integral: Scalar  # K s: of the temperature error


class Asked(eqx.Module):
    """What a call works out on its way to the voltage."""

    stress: Scalar  # Pa, x_3
    fraction: Scalar  # -, x_4
    fraction_rate: Scalar  # 1/s
    heating: Scalar  # 1 or 0: the curve used
    temperature: Scalar  # C, Phi_1
    temperature_rate: Scalar  # C/s
    temperature_error: Scalar  # C, z
    power: Scalar  # W/m, U, before it is bounded


class BacksteppingTwo(AbstractController):
    """Needs position, rate, temperature and the amplitudes xi_M and xi_A; `believed` is the plant as the controller knows it.

    The curve changes with the sign of the wanted fraction's rate: there the voltage jumps and has no derivative.
    """

    believed: System
    damping_gain: Scalar = parameter("1/s", 0.0, 1e4, "K: weight of the rate in the stress wanted (eq. 4.70)")
    temperature_gain: Scalar = parameter("1/s", 0.0, 1e4, "K_1: how fast the temperature's error dies out")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "largest command; the smallest is zero", limits_command=True)
    edge: Scalar = parameter(
        "-", 1e-12, 0.5, "distance from the ends of arccos from where on its slope is held", default=1e-6
    )
    rest_torque_share: Scalar = parameter(
        "-", 0.0, 1.0, "share of h_0 taken off h: 1 as eq. 4.70 prints, which moves the equilibrium", default=0.0
    )
    position_gain: Scalar = parameter(
        "1/s^2", 0.0, 1e4, "weight of the error in the stress wanted: 1 as eq. 4.70 prints", default=1.0
    )
    integral_rate: Scalar = parameter(
        "1/s", 0.0, 1e3, "1/T_i: weight of the integral of the pull beside the pull itself; 0 as printed", default=0.0
    )
    stress_share: Scalar = parameter(
        "-", 0.0, 1.0, "share of the stress error in the acceleration: 0 as eq. 4.76, 1 exact, with x_3", default=0.0
    )
    epsilon: Scalar = parameter("-", -1.0, 1.0, "of eq. 4.81 and 4.87", default=0.0)
    cross_share: Scalar = parameter(
        "-",
        -1.0,
        1.0,
        "of C (alpha/I)(epsilon x_1 + x_2) in v: 1 as eq. 4.87 prints, -1 the sign it needs",
        default=0.0,
    )
    temperature_integral_rate: Scalar = parameter(
        "1/s",
        0.0,
        1e3,
        "1/T_z: weight of the integral of the temperature error beside that error; 0 as printed",
        default=0.0,
    )

    # The wire read backwards from the measured state (`inverse_wire.strain_offset`), for laws other than eq. 4.51.
    anchored: bool = eqx.field(static=True, default=False)

    def start(self, measured: MeasuredState, wanted: Reference) -> BacksteppingTwoMemory:
        return BacksteppingTwoMemory(
            jnp.ones_like(measured.position), jnp.zeros_like(measured.position), jnp.zeros_like(measured.position)
        )

    def stress_wanted(
        self, position: Scalar, velocity: Scalar, wanted: Reference, integral: Scalar | float = 0.0
    ) -> Scalar:
        """x_3 of eq. 4.70, Pa; never negative: a wire cannot push."""
        equation, inertia = equation_of(self.believed), self._inertia()
        torque = equation.resistance(position, velocity) - self.rest_torque_share * equation.resistance(
            wanted.position, jnp.zeros_like(velocity)
        )
        torque = torque + inertia * self._acceleration(position, velocity, wanted, integral)
        stress = torque / force_per_stress(self.believed)
        return jnp.where(stress < 0.0, 0.0, stress)  # so that nan stays nan

    def asked(self, memory: BacksteppingTwoMemory, measured: MeasuredState, wanted: Reference) -> Asked:
        """From the state to the power."""
        believed, law = self.believed, self.believed.wire.kinetics

        offset = strain_offset(believed, measured) if self.anchored else 0.0

        def stress_and_fraction(
            position: Scalar, velocity: Scalar, wanted: Reference, integral: Scalar
        ) -> tuple[Scalar, Scalar]:
            stress = self.stress_wanted(position, velocity, wanted, integral)
            return stress, fraction_for(believed, position, stress, offset)

        here = measured.position, measured.velocity, wanted, memory.integral
        moving = Reference(wanted.velocity, wanted.acceleration, jnp.zeros_like(wanted.acceleration))
        wish = self._acceleration(*here)
        (stress, fraction), (stress_rate, fraction_rate) = jax.jvp(
            stress_and_fraction,
            here,
            (measured.velocity, wish, moving, self._pull(measured.position, measured.velocity, wanted)),
        )
        # The curve follows the wish: an arm that the wire does not move yet shows no acceleration to go by.
        heating = (fraction_rate < 0.0) | ((fraction_rate == 0.0) & (memory.heating > 0.5))
        push = force_per_stress(believed) / self._inertia()
        missed = self.stress_share * push * (measured.stress - stress)
        zero, still = jnp.zeros_like(missed), jax.tree.map(jnp.zeros_like, moving)
        _, (stress_miss, fraction_miss) = jax.jvp(stress_and_fraction, here, (zero, missed, still, zero))
        stress_rate, fraction_rate = stress_rate + stress_miss, fraction_rate + fraction_miss
        temperature, rate = jax.jvp(
            lambda fraction, stress: temperature_for(
                law, fraction, stress, heating, measured.xi_M, measured.xi_A, self.edge
            ),
            (fraction, stress),
            (fraction_rate, stress_rate),
        )
        error = measured.temperature - temperature
        slope = jnp.where(heating, law.stress_slope_austenite, law.stress_slope_martensite)
        off, off_rate = measured.position - wanted.position, measured.velocity - wanted.velocity
        cross = self.cross_share * slope * push * (self.epsilon * off + off_rate)
        pull = -self.temperature_gain * (error + self.temperature_integral_rate * memory.inner_integral)
        power = power_for(believed, measured.temperature, cross + pull + rate)
        return Asked(stress, fraction, fraction_rate, 1.0 * heating, temperature, rate, error, power)

    def step(
        self, memory: BacksteppingTwoMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[BacksteppingTwoMemory, Scalar]:
        unlimited = self.asked(memory, measured, wanted)
        voltage = voltage_for(
            self.believed, unlimited.power, measured.temperature, unlimited.fraction, self.largest_voltage
        )
        pull = self._pull(measured.position, measured.velocity, wanted)
        integral = next_integral(memory.integral, pull, period, voltage, self.largest_voltage)
        inner = next_integral(memory.inner_integral, unlimited.temperature_error, period, voltage, self.largest_voltage)
        return BacksteppingTwoMemory(unlimited.heating, integral, inner), voltage

    def _inertia(self) -> Scalar:
        return equation_of(self.believed).inertia()

    def _acceleration(self, position: Scalar, velocity: Scalar, wanted: Reference, integral: Scalar | float) -> Scalar:
        """theta'' that the stress wanted gives: theta_d'' - w - w_0/T_i, with w = K_0 x_1 + K x_2."""
        return wanted.acceleration - self._pull(position, velocity, wanted) - self.integral_rate * integral

    def _pull(self, position: Scalar, velocity: Scalar, wanted: Reference) -> Scalar:
        """w = K_0 x_1 + K x_2, rad/s^2, which the integral sums up."""
        off, off_rate = position - wanted.position, velocity - wanted.velocity
        return self.position_gain * off + self.damping_gain * off_rate
