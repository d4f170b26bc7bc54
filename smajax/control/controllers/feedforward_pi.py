r"""Feedforward through the plant's own hysteresis along a path that the wire can follow, and PI control of what is left.

The set point theta_d is approached on a path theta_r, and the command is what the model says for the path, corrected by the error from it:

    theta_r' = f(theta_d - theta_r) held in [-v_r, v_r],      e = theta_r - theta
    u        = u_0(theta_r, theta_r') + K_p e + I + K_d (theta_r' - v),      dI/dt = K_i e

f is (theta_d - theta_r)/t_r, with `braking` a parabola further away (`approach`). u_0 holds the branch temperature T of the hysteresis at theta_r (`quasi_static`) and warms the wire along it: the command whose heat is that of
T + tau T'. It is of the model that the controller is given, a found one with its effects. What the model has wrong, I makes up for. While the command is at its
limit, path and I wait where they would push it further: so the path begins once the wire is hot enough to follow, and nothing winds up.
The position alone is read; v is its filtered difference. With K_d = 0 it is a plain PI controller.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.control.controllers.approach import approach_speed, braking_parameter
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.preset import ANGLE, EQUATION, Box, ControllerPreset
from smajax.control.controllers.quasi_static import Hysteresis, Turns, hysteresis_of, leading_command, no_turns, turned
from smajax.control.controllers.rate import Rate, at_rest, filtered_rate
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.system import System
from smajax.model.types import Scalar


class FeedforwardPiMemory(eqx.Module):
    """What the controller remembers."""

    path: Scalar  # rad, theta_r
    push: Scalar  # 1: the command was at its upper limit, -1: at its lower one, else 0
    integral: Scalar  # V
    motion: Rate  # rad, rad/s
    turns: Turns


class FeedforwardPi(AbstractController):
    """Reads the position only; `hysteresis` is that of the plant that it believes in."""

    hysteresis: Hysteresis
    proportional_gain: Scalar = parameter("V/rad", 0.0, 1e6, "K_p")
    integral_gain: Scalar = parameter("V/(rad s)", 0.0, 1e6, "K_i")
    path_speed: Scalar = parameter("rad/s", 0.0, 1e4, "v_r: largest speed of the path")
    path_time: Scalar = parameter("s", 1e-3, 1e4, "t_r: time constant with which the path comes to its end")
    largest_voltage: Scalar = parameter("V", 0.0, 1e4, "upper limit of the command", limits_command=True)
    derivative_gain: Scalar = parameter("V s/rad", 0.0, 1e6, "K_d; 0: a PI controller", default=0.0)
    rate_filter: Scalar = parameter("s", 0.0, 10.0, "time constant of the velocity's filter", default=0.02)
    braking: Scalar = braking_parameter()

    def start(self, measured: MeasuredState, wanted: Reference) -> FeedforwardPiMemory:
        zero, here = jnp.zeros_like(measured.position), measured.position
        return FeedforwardPiMemory(here, zero, zero, at_rest(here), no_turns(here))

    def step(
        self, memory: FeedforwardPiMemory, measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[FeedforwardPiMemory, Scalar]:
        left = wanted.position - memory.path
        towards = approach_speed(left, 1.0 / (self.path_time + period), self.braking)
        speed = limited(towards, -self.path_speed, self.path_speed)
        speed = jnp.where(memory.push * speed > 0.0, 0.0, speed)
        path = memory.path + period * speed
        turns = turned(self.hysteresis, memory.turns, path)
        led = leading_command(self.hysteresis, turns, path, speed)
        error = path - measured.position
        motion = filtered_rate(memory.motion, measured.position, self.rate_filter, period)
        damping = self.derivative_gain * (speed - motion.rate)
        unlimited = led + self.proportional_gain * error + memory.integral + damping
        voltage = limited(unlimited, 0.0, self.largest_voltage)
        push = jnp.where(unlimited > self.largest_voltage, 1.0, jnp.where(unlimited < 0.0, -1.0, 0.0))
        waits = push * error > 0.0
        integral = memory.integral + jnp.where(waits, 0.0, period) * self.integral_gain * error
        return FeedforwardPiMemory(path, push, integral, motion, turns), voltage


def feedforward_pi(system: System) -> FeedforwardPi:
    """Gains of the arm, searched on the filter `model` with noise and delay.

    Those of studies/requirement/gains/feedforward_pi.json, with `braking`, are slower and meet its limits in all of its loops but one.
    """
    return FeedforwardPi(
        hysteresis=hysteresis_of(system),
        proportional_gain=53.5,
        integral_gain=37.7,
        path_speed=2.13,
        path_time=0.313,
        largest_voltage=10.0,
        derivative_gain=8.43,
    )


BOX: Box = {
    "proportional_gain": (0.5, 100.0),
    "integral_gain": (0.1, 200.0),
    "derivative_gain": (0.05, 30.0),
    "path_speed": (0.3, 10.0),
    "path_time": (0.02, 1.0),
}
PRESET = ControllerPreset(
    feedforward_pi, "proportional_gain", ANGLE, BOX, needs=EQUATION, known=frozenset({"hysteresis"})
)
