"""Tight event-aware integration of a shape-memory wire on an arm or under a dead weight, the reference for simulators.

Written from the equations alone (Elahinia 2004, chapter 3, with its sign and renewal corrections); shares no code with
the simulator it judges. Each call takes seconds, so tests can run it live. SI units, degrees Celsius, radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from studies.reference.event_march import Vector, march
from studies.reference.loaded_modes import LoadedModes
from studies.reference.wire_modes import Load, Modes
from studies.reference.wire_parameters import ArmParameters, BiasSpringParameters, DeadWeightParameters, WireParameters

__all__ = [
    "ArmParameters",
    "BiasSpringParameters",
    "DeadWeightParameters",
    "WireParameters",
    "simulate_arm",
    "simulate_bias_spring",
    "simulate_dead_weight",
]

Voltage = float | Callable[[float], float]
Piece = tuple[float, Voltage, Load]
Controller = Callable[[float, float, float, float, float, float, Any], tuple[float, Any]]
GRAVITY = 9.81
SCALES = np.array([1.0, 1e6, 1e-2, 1e-2, 1e-4, 1e-1])  # absolute tolerances of T, stress, q, q', gap, xi_s, per rtol


def simulate_arm(
    params: ArmParameters,
    voltage_segments: Sequence[tuple[float, Voltage]],
    t_eval: ArrayLike,
    *,
    rtol: float = 1e-9,
    method: str = "DOP853",
    controller: Controller | None = None,
    period: float | None = None,
    memory: Any = None,
) -> dict[str, Vector]:
    """Arm lifted by the wire against gravity and spring (Elahinia 2004, eqs. 3.7, 3.8); starts at rest at t = 0.

    `voltage_segments`: (end time, volts) in turn; volts may be a smooth function of time; A or W where the parameters'
    `drive` says so. `t_eval`: ascending times, s. With a `controller` leave the segments empty: every `period` seconds,
    from 0 on, it gives (volts, memory) for (time, angle, angular velocity, temperature, stress, martensite fraction,
    memory), and the volts are held; the first call is given `memory`.
    Returns arrays shaped like `t_eval`: time (s), angle (rad), angular_velocity (rad/s), temperature (degC),
    stress (Pa), martensite_fraction, detwinned_fraction, strain (of the wire, from its start), and with a controller
    volts (from each sample on). Raises ValueError on times out of order.
    """
    if (controller is None) != (period is None) or (controller is None) != bool(voltage_segments):
        raise ValueError(
            "expected either voltage segments, or a controller with a period and no segments; drop one of the two"
        )
    p = params
    inertia = p.payload_mass * p.arm_length**2 + p.arm_mass * p.arm_length**2 / 3
    moment = (p.payload_mass + p.arm_mass / 2) * GRAVITY * p.arm_length
    spring = p.spring_stiffness * p.spring_radius**2
    load = Load(
        ratio=2 * p.pulley_radius,
        inertia=inertia,
        damping=p.damping,
        resistance=lambda q: moment * math.cos(q) + spring * (q - p.spring_rest_angle),
        low=p.lowest_angle,
        high=p.highest_angle,
    )
    start = (p.initial_stress, p.initial_angle)
    if controller is None or period is None:
        out = _integrate(p, [(end, volts, load) for end, volts in voltage_segments], *start, t_eval, rtol, method)
    else:
        out = _integrate(p, _Sampled(controller, period, memory, load), *start, t_eval, rtol, method)
    return {"angle": out.pop("q"), "angular_velocity": out.pop("speed"), **out}


def simulate_dead_weight(
    params: DeadWeightParameters,
    segments: Sequence[tuple[float, Voltage, float]],
    t_eval: ArrayLike,
    *,
    rtol: float = 1e-9,
    method: str = "DOP853",
) -> dict[str, Vector]:
    """Weight hung on the wire (Elahinia 2004, eqs. 3.13, 3.14); starts at rest, stress m g/A_w, at t = 0.

    `segments`: (end time, volts, mass in kg) in turn; volts (A or W where `drive` says so) may be a smooth function of
    time; the mass changes at once, speed and stress continuous. `t_eval`: ascending times, s. Returns arrays shaped
    like `t_eval`: time (s), position (m, + = lifted), velocity (m/s), temperature (degC), stress (Pa),
    martensite_fraction, detwinned_fraction, strain (of the wire, from its start). Raises ValueError on times out of
    order.
    """

    def hung(mass: float) -> Load:
        return Load(ratio=1.0, inertia=mass, damping=params.damping, resistance=lambda _q: mass * GRAVITY)

    pieces = [(end, volts, hung(mass)) for end, volts, mass in segments]
    stress = segments[0][2] * GRAVITY / params.area
    out = _integrate(params, pieces, stress, 0.0, t_eval, rtol, method)
    return {"position": out.pop("q"), "velocity": out.pop("speed"), **out}


def simulate_bias_spring(
    params: BiasSpringParameters,
    voltage_segments: Sequence[tuple[float, Voltage]],
    t_eval: ArrayLike,
    *,
    rtol: float = 1e-9,
    method: str = "DOP853",
) -> dict[str, Vector]:
    """Slider pulled by the wire against a preloaded spring: m q'' + b q' + F_0 + k q = A_w stress; starts at rest at t = 0.

    Arguments and results as `simulate_dead_weight`'s, without a mass in the segments.
    """
    load = Load(
        ratio=1.0,
        inertia=params.slider_mass,
        damping=params.damping,
        resistance=lambda q: params.spring_preload + params.spring_stiffness * q,
    )
    pieces = [(end, volts, load) for end, volts in voltage_segments]
    out = _integrate(params, pieces, params.spring_preload / params.area, 0.0, t_eval, rtol, method)
    return {"position": out.pop("q"), "velocity": out.pop("speed"), **out}


class _Sampled:
    """Pieces of one period each, their volts from a controller that sees the state at the start of each."""

    def __init__(self, controller: Controller, period: float, memory: Any, load: Load) -> None:
        self.controller, self.period, self.memory, self.load = controller, period, memory, load
        self.given: list[float] = []

    def volts(self, t: float, s: Vector, xi: float) -> float:
        """Volts for the period that starts now."""
        angle, speed, temperature, stress = (float(s[i]) for i in (2, 3, 0, 1))
        volts, self.memory = self.controller(t, angle, speed, temperature, stress, xi, self.memory)
        self.given.append(float(volts))
        return self.given[-1]


def _integrate(
    wire: WireParameters,
    drive: Sequence[Piece] | _Sampled,
    stress: float,
    start: float,
    t_eval: ArrayLike,
    rtol: float,
    method: str,
) -> dict[str, Vector]:
    """Piece by piece from event to event; arrays at `t_eval`, with q and speed for the load's coordinate."""
    times = np.asarray(t_eval, dtype=float)
    if isinstance(drive, _Sampled):
        count = math.floor(times[-1] / drive.period * (1 + 1e-12)) + 1  # a last sample may fall on the last time
        ends, load = [(i + 1) * drive.period for i in range(count)], drive.load
    else:
        ends, load = [end for end, _, _ in drive], drive[0][2]
    if np.any(np.diff(times) <= 0) or np.any(np.diff([0.0, *ends]) <= 0) or times[0] < 0 or times[-1] > ends[-1]:
        raise ValueError(
            f"times run {times[0]} to {times[-1]} s, segments end at {ends}; "
            "expected both ascending, from 0 and within the last segment; sort them or lengthen the last segment"
        )
    rest = 1e3 * rtol
    modes = Modes(wire, load, rest_rate=rest) if wire.law is None else LoadedModes(wire, load, rest)
    first = wire.ambient_temperature if wire.initial_temperature is None else wire.initial_temperature
    state = np.array([first, stress, start, 0.0, 0.0])
    if isinstance(modes, LoadedModes):
        state = np.append(state, modes.first_detwinned(stress))
    modes.stop = -1 if start <= load.low else 1 if start >= load.high else 0

    def begin(i: int, t: float, s: Vector) -> None:
        volts: Voltage
        if isinstance(drive, _Sampled):
            volts = drive.volts(t, s, modes.fraction(s))
        else:
            _, volts, modes.load = drive[i]
        modes.volts = volts if callable(volts) else _constant(volts)

    segments = [(end, partial(begin, i)) for i, end in enumerate(ends)]
    states = march(modes, segments, state, times, rtol * SCALES[: state.size], rtol, method)
    xi, load = states[-1], modes.load
    out = {
        "time": times,
        "q": states[2],
        "speed": states[3],
        "temperature": states[0],
        "stress": np.maximum(states[1], 0.0),
        "martensite_fraction": xi,
        "detwinned_fraction": modes.detwinned(states, xi) if isinstance(modes, LoadedModes) else xi,
        "strain": -load.ratio * (states[2] - start) / wire.length - states[4],
    }
    if isinstance(drive, _Sampled):
        out["volts"] = np.array(drive.given)[np.searchsorted(ends, times, side="right")]
    return out


def _constant(value: float) -> Callable[[float], float]:
    return lambda _t: value
