"""Stress-based sliding control once more, in plain Python, for the reference's sampled loop (Elahinia 2004, sec. 4.7)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Controller = Callable[[float, float, float, float, float, float, float], tuple[float, float]]


def sliding_controller(gains: Any, target: float, period: float) -> Controller:
    """Eq. 4.44, 4.45 and a PI controller on the stress, from an object with the gains and the arm it believes in."""
    arm = gains.equation.load
    mass, link, length = (float(getattr(arm, name)) for name in ("payload_mass", "link_mass", "arm_length"))
    inertia = (mass + link / 3.0) * length**2
    spring = float(arm.spring_stiffness) * float(arm.spring_lever) ** 2
    rest, damping = float(arm.spring_rest_angle), float(arm.damping)
    pull = 2.0 * float(arm.pulley_radius) * float(gains.cross_section)
    slope, gain, boundary = (float(getattr(gains, name)) for name in ("surface_slope", "gain", "boundary"))

    def wanted(angle: float, rate: float) -> float:
        surface = min(max((rate + slope * (angle - target)) / boundary, -1.0), 1.0)
        held = (mass + 0.5 * link) * 9.81 * length * np.cos(angle) + spring * (angle - rest)
        torque = held + damping * rate - inertia * slope * rate - gain * surface
        return max(float(torque) / pull, 0.0)

    def controller(
        time: float, angle: float, rate: float, temperature: float, stress: float, xi: float, memory: float
    ) -> tuple[float, float]:
        error = wanted(angle, rate) - stress
        summed = memory + period * error
        unlimited = float(gains.stress_gain) * error + float(gains.stress_integral_gain) * summed
        volts = min(max(unlimited, 0.0), float(gains.largest_voltage))
        return volts, summed if volts == unlimited else memory

    return controller
