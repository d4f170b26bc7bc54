r"""NVSC: VSC3, and proportional control of the temperature while the arm passes its angle of greatest stress.

Beyond that angle the stress, and with it the range in which the wire transforms (Elahinia 2004, eq. 4.35), falls: a wire as hot as
the VSC leaves it then transforms with no more heat and the arm runs on. So (sec. 4.6, eq. 4.36, 4.37)

    u = (1 - w) u_VSC + w u_T,      u_T = K_p (T_d - T) held in [0, V_high],
    w = [1 - |s_2| / phi_T]_0^1 [v / v_p]_0^1,      s_2 = dA_f'/dt,      A_f' = A_f + sigma / C_A.

What is printed, and what is done with it:

- eq. 4.37 has temperature control wherever |s_2| < phi_T. That holds at rest too, where A_f' stands still as the arm does,
  and the set point would then be held by a guess of the temperature. The words say "remains the same as previous VSC except
  where the arm is passing through the maximum stress position": so it takes over only as far as the arm moves up
  (v / v_p) and A_f' stands still all the same. `AsPrinted` is the printed rule.
- Eq. 4.37 switches at the edge of the band; the weight w falls to zero there instead, so that u is continuous and has a
  derivative in phi_T. `AsPrinted` switches.
- K_p (T - T_d) heats a wire that is too hot; the sign here is the other one.
- T_d is "a linear approximation ... as a function of desired position, transformation temperatures, and estimated
  temperature": on the straight line from the present state to the end of the transformation,
  T_d = T + (A_f' - T)(theta_d - theta)/(theta_f - theta), with theta_f the angle at which all is austenite.

What does the work on the arm: damping and temperature, both. A_f' changes by a few ten C/s at most in steps to set points
from -30 to 65 degrees; with a band beyond that the weight is nearly v / v_p throughout and takes voltage away with the speed,
whatever the temperature. The preset's band is searched inside of that range (figure rows C8 and C10 have the numbers).
With K_p = 0 most of the overshoot vanishes as well; what u_T adds is an earlier arrival at large angles (1.7 s in the
place of 2.2 s at 50 degrees).

The band phi_T = 0 makes NVSC equal to VSC3 exactly. An infinite phi_T would do so only if it were the VSC's band, with
temperature control where |s_2| > phi_T; the overshoot would then grow with phi_T, where Fig. 4.15 has it fall.
"""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.rate import Rate, at_rest, filtered_rate
from smajax.control.controllers.vsc3 import Vsc3
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class AbstractBand(eqx.Module):
    """When the temperature is controlled."""

    @abc.abstractmethod
    def share(self, range_rate: Scalar, band: Scalar, velocity: Scalar) -> Scalar:
        """Weight (0 ... 1) of temperature control at s_2 and phi_T (C/s) and the velocity."""


class Passing(AbstractBand):
    """Only as far as the arm moves up."""

    passing_speed: Scalar = parameter("rad/s", 1e-6, 1e9, "v_p: from here on the arm is passing, below it the less so")

    def share(self, range_rate: Scalar, band: Scalar, velocity: Scalar) -> Scalar:
        wide = ~(band <= 0.0)  # nan is
        near = limited(1.0 - jnp.abs(range_rate) / jnp.where(wide, band, 1.0), 0.0, 1.0)
        return jnp.where(wide, near, 0.0) * limited(velocity / self.passing_speed, 0.0, 1.0)


class AsPrinted(AbstractBand):
    """Eq. 4.37: everywhere inside of the band, at rest too. No derivative in phi_T."""

    def share(self, range_rate: Scalar, band: Scalar, velocity: Scalar) -> Scalar:
        # nan in, nan out: a comparison alone would hide it.
        return jnp.where(jnp.abs(range_rate) < band, 1.0, 0.0) + 0.0 * (range_rate + band)


class TemperatureVscMemory(eqx.Module):
    """What the controller remembers."""

    vsc: Rate
    finish: Rate  # A_f', C, and its rate s_2, C/s


class TemperatureVsc(AbstractController):
    """Reads position, velocity, stress and temperature. The last four temperatures are those that the controller believes in."""

    vsc: Vsc3
    band: AbstractBand
    temperature_band: Scalar = parameter("degC/s", 0.0, 1e9, "phi_T: rate of A_f' below which it stands still")
    temperature_gain: Scalar = parameter("V/degC", 0.0, 1e4, "K_p")
    finish_filter: Scalar = parameter("s", 0.0, 10.0, "time constant of the filter of dA_f'/dt")
    finish_temperature: Scalar = parameter("degC", -100.0, 400.0, "A_f at zero stress that the controller believes in")
    stress_slope: Scalar = parameter("Pa/K", 1e6, 1e8, "C_A that it believes in")
    finish_position: Scalar = parameter("rad", -7.0, 7.0, "theta_f: where all is austenite")
    shortest_way: Scalar = parameter(
        "rad", 1e-9, 7.0, "the line to theta_f is no steeper than if this were left of the way", default=0.02
    )

    def finish(self, measured: MeasuredState) -> Scalar:
        """A_f', C (eq. 4.35)."""
        return self.finish_temperature + measured.stress / self.stress_slope

    def temperature_wanted(self, measured: MeasuredState, wanted: Reference) -> Scalar:
        """T_d, C."""
        left = self.finish_position - measured.position
        way = jnp.where(left < self.shortest_way, self.shortest_way, left)
        share = (wanted.position - measured.position) / way
        return measured.temperature + share * (self.finish(measured) - measured.temperature)

    def start(self, measured: MeasuredState, wanted: Reference) -> TemperatureVscMemory:
        return TemperatureVscMemory(self.vsc.start(measured, wanted), at_rest(self.finish(measured)))

    def step(
        self, memory: TemperatureVscMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[TemperatureVscMemory, Scalar]:
        vsc, by_position = self.vsc.step(memory.vsc, measured, wanted, period)
        finish = filtered_rate(memory.finish, self.finish(measured), self.finish_filter, period)
        error = self.temperature_wanted(measured, wanted) - measured.temperature
        by_temperature = limited(self.temperature_gain * error, 0.0, self.vsc.high_voltage)
        share = self.band.share(finish.rate, self.temperature_band, measured.velocity)
        return TemperatureVscMemory(vsc, finish), by_position + share * (by_temperature - by_position)
