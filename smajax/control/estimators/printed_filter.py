r"""Extended Kalman filter of the arm as the source prints it (Elahinia 2004, sec. 4.5, eq. 4.23-4.32).

State [theta, theta', sigma, T] in rad, rad/s, MPa, C: the source gives the first guess in these units (eq. 4.32) and sets
P_0 = I and Q = 0.01 I, which mean nothing in others; the stress alone differs from SI. Predictions, T_s the period:

    f_1 = theta + T_s theta'                                                       (eq. 4.24)
    f_2 = (theta - theta_{k-2}) / T_s                                              (eq. 4.25)
    f_3 = [I (theta' - theta'_{k-2}) / T_s + tau_g(f_1) + tau_s(f_1) + c f_2] / (2 r A_w)    (eq. 4.26, 4.27)
    f_4 = T + T_s (power - h_c A_c (T - T_inf)) / (m c_p)                          (eq. 4.28)

Two of them need the sample before the last, which the printed Jacobian (4.29) drops: here it belongs to the state. The
fraction is no state; it follows from the stress and the temperature by the kinetics.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.kalman import Belief, Innovation, Matrix, Vector, corrected, propagated
from smajax.control.measured_state import MeasuredState
from smajax.core.parameters import parameter
from smajax.model.drive.none import NoDrive
from smajax.model.load.arm import Arm
from smajax.model.load.coupon import Coupon
from smajax.model.system import System, ambient_temperature, heating_power, initial_state
from smajax.model.types import Scalar, State
from smajax.model.wire.heat import HeatState, cross_section, heat_rate, mass_per_metre
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.input_delay import refuse_lag
from smajax.simulation.step import step

MEGA = 1e6


class AbstractJacobian(eqx.Module):
    """Derivative of the predictions."""

    @abc.abstractmethod
    def of(
        self, system: System, transition: Callable[[Vector], Vector], at: Vector, period: Scalar, origin: Scalar | float
    ) -> Matrix:
        """6 x 6, the sample before the last in the last two rows and columns; the angles of `at` count from `origin`, rad."""


class PastCarried(AbstractJacobian):
    """The whole derivative: an error of theta_{k-2} is remembered, and cancels in f_2 what theta_{k-1} shares with it."""

    def of(
        self, system: System, transition: Callable[[Vector], Vector], at: Vector, period: Scalar, origin: Scalar | float
    ) -> Matrix:
        return jax.jacfwd(transition)(at)


class PastDropped(AbstractJacobian):
    """Eq. 4.29 and 4.30 to the letter: theta_{k-2} as if it were exact, and A_32 without the acceleration."""

    def of(
        self, system: System, transition: Callable[[Vector], Vector], at: Vector, period: Scalar, origin: Scalar | float
    ) -> Matrix:
        load = system.load
        torque_to_stress = load.lever() * cross_section(system.wire) * MEGA
        angle, rate = origin + at[0] + period * at[1], (at[0] - at[4]) / period
        along_angle, along_rate = jax.grad(load.resistance, (0, 1))(angle, rate, {})
        whole = jax.jacfwd(transition)(at)
        printed = jnp.zeros_like(whole).at[0, 0].set(1.0).at[0, 1].set(period).at[1, 0].set(1.0 / period)
        printed = printed.at[2, 0].set(along_angle / torque_to_stress).at[2, 1].set(along_rate / torque_to_stress)
        return printed.at[3, 3].set(whole[3, 3])


class PrintedFilterMemory(eqx.Module):
    """Estimate after the last reading, and the wire that its stress and temperature lead along the kinetics."""

    belief: Belief  # rad, rad/s, MPa, C; then angle (rad) and rate (rad/s) one sample earlier
    # rad, from which both angles count. The stress comes of their difference over the square of a period: as angles of
    # 1 rad they would have lost four of single precision's seven digits of it.
    reading: Scalar
    coupon: State
    innovation: Innovation


class PrintedFilter(AbstractEstimator):
    """`system` is the arm, wire and drive that the filter believes in.

    `reading_variance` is R, which the source does not print (it calls Q "measurement noise covariance", where its place
    in eq. 4.21 is that of process noise). It is a setting of this filter, and not the variance of the loop's sensor
    (`with_reading_noise` leaves it): a rate from the difference of two readings, and a stress from that of two rates, are bearable
    with a large R only.
    """

    system: System
    reading_variance: Scalar = parameter("rad^2", 1e-18, 1e6, "R: variance of a reading")
    process_variance: Scalar = parameter("rad^2, (rad/s)^2, MPa^2, K^2", 0.0, 1e6, "q of Q = q I, a sample")
    start_variance: Scalar = parameter("rad^2, (rad/s)^2, MPa^2, K^2", 0.0, 1e6, "p of P_0 = p I")
    start_stress: Scalar = parameter("Pa", 0.0, 1e9, "stress believed at the start (eq. 4.32)")
    start_temperature: Scalar = parameter("degC", -100.0, 400.0, "temperature believed at the start (eq. 4.32)")
    jacobian: AbstractJacobian = PastCarried()

    def start(self, reading: Scalar) -> tuple[PrintedFilterMemory, MeasuredState]:
        zero = jnp.zeros_like(reading)
        angle = self.system.load.start() - reading
        guess = jnp.stack([angle, zero, self.start_stress / MEGA, self.start_temperature, angle, zero])
        inputs = {"temperature": self.start_temperature, "stress": self.start_stress}
        coupon = initial_state(self._coupon(), inputs)
        belief = Belief(guess, self.start_variance * jnp.eye(guess.size, dtype=guess.dtype))
        belief, innovation = self._read(belief)
        # At rest before the first sample: the earlier angle is the angle.
        belief = Belief(belief.mean.at[4].set(belief.mean[0]), belief.covariance)
        return self._told(belief, reading, coupon, innovation)

    def step(
        self, memory: PrintedFilterMemory, reading: Scalar, voltage: Scalar, period: Scalar
    ) -> tuple[PrintedFilterMemory, MeasuredState]:
        def transition(vector: Vector) -> Vector:
            return self.transition(vector, memory.coupon, voltage, period, memory.reading)

        mean, covariance = memory.belief.mean, memory.belief.covariance
        jacobian = self.jacobian.of(self.system, transition, mean, period, memory.reading)
        noise = jnp.zeros_like(mean).at[:4].set(self.process_variance)
        further = jnp.zeros_like(mean).at[jnp.asarray((0, 4))].set(reading - memory.reading)
        belief = Belief(transition(mean) - further, propagated(covariance, jacobian, jnp.diag(noise)))
        belief, innovation = self._read(belief)
        inputs = {"temperature": belief.mean[3], "stress": MEGA * belief.mean[2]}
        return self._told(belief, reading, step(self._coupon(), memory.coupon, inputs, period), innovation)

    def transition(
        self, vector: Vector, coupon: State, voltage: Scalar, period: Scalar, origin: Scalar | float = 0.0
    ) -> Vector:
        """f of eq. 4.24-4.28, and the sample that was the last. origin: from which the angles count, rad."""
        refuse_lag(self.system, "a filter")
        load, wire, terms = self.system.load, self.system.wire, self.system.terms
        assert isinstance(load, Arm)
        angle, rate, _, temperature, earlier_angle, earlier_rate = vector
        next_angle, next_rate = angle + period * rate, (angle - earlier_angle) / period
        acceleration = (rate - earlier_rate) / period
        torque = load.inertia({}) * acceleration + load.resistance(origin + next_angle, next_rate, {})
        stress = torque / (load.lever() * cross_section(wire))
        fraction = coupon.wire.martensite_fraction
        ohms = resistance_per_metre(wire, terms.resistance, temperature, fraction)
        power = heating_power(self.system, ohms, self.system.drive.from_command(voltage))
        ambient = ambient_temperature(self.system, coupon.time, {})
        at = HeatState(temperature, ambient, fraction, coupon.time, coupon.wire, period)
        warming = heat_rate(wire, terms.heat, at, power)
        warming = warming / (mass_per_metre(wire) * wire.heat.specific_heat)
        return jnp.stack([next_angle, next_rate, stress / MEGA, temperature + period * warming, angle, rate])

    def _coupon(self) -> System:
        """The believed wire under prescribed temperature and stress."""
        return dataclasses.replace(self.system, load=Coupon(), drive=NoDrive())

    def _read(self, belief: Belief) -> tuple[Belief, Innovation]:
        """Corrected by the reading from which its angles count."""
        angle = jnp.zeros_like(belief.mean).at[0].set(1.0)
        return corrected(belief, jnp.zeros_like(belief.mean[0]), angle, self.reading_variance)

    def _told(
        self, belief: Belief, reading: Scalar, coupon: State, innovation: Innovation
    ) -> tuple[PrintedFilterMemory, MeasuredState]:
        angle, rate, stress, temperature = belief.mean[:4]
        wire = coupon.wire
        measured = MeasuredState(
            reading + angle, rate, MEGA * stress, temperature, wire.martensite_fraction, wire.xi_M, wire.xi_A
        )
        return PrintedFilterMemory(belief, reading, coupon, innovation), measured
