"""Tight event-aware integration of a shape-memory wire on an arm or under a dead weight, to judge simulators by.

Written from the equations alone (Elahinia 2004, chapter 3, with its sign and renewal corrections); shares no code with
the simulator it judges. Each call takes seconds, so tests can run it live. SI units, degrees Celsius, radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from studies.reference.wire_modes import Load, Modes, Vector
from studies.reference.wire_parameters import ArmParameters, DeadWeightParameters, WireParameters

__all__ = ["ArmParameters", "DeadWeightParameters", "WireParameters", "simulate_arm", "simulate_dead_weight"]

Voltage = float | Callable[[float], float]
GRAVITY = 9.81
MAX_EVENTS = 100_000
MAX_STEP = 1e-2  # s: events are looked for at step ends, so a step must be short against the load's vibration
FINEST_STEP = 1e-5
SCALES = np.array([1.0, 1e6, 1e-2, 1e-2, 1e-4])  # absolute tolerances of T, stress, q, q', gap per unit of rtol


def simulate_arm(
    params: ArmParameters,
    voltage_segments: Sequence[tuple[float, Voltage]],
    t_eval: ArrayLike,
    *,
    rtol: float = 1e-9,
    method: str = "DOP853",
) -> dict[str, Vector]:
    """Arm lifted by the wire against gravity and spring (Elahinia 2004, eqs. 3.7, 3.8); starts at rest at t = 0.

    `voltage_segments`: (end time, volts) in turn; volts may be a smooth function of time. `t_eval`: ascending times, s.
    Returns arrays shaped like `t_eval`: time (s), angle (rad), angular_velocity (rad/s), temperature (degC),
    stress (Pa), martensite_fraction, strain (of the wire, from its start). Raises ValueError on times out of order.
    """
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
    segments = [(end, volts, load) for end, volts in voltage_segments]
    out = _integrate(p, segments, p.initial_stress, p.initial_angle, t_eval, rtol, method)
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

    `segments`: (end time, volts, mass in kg) in turn; volts may be a smooth function of time; the mass changes at once,
    speed and stress continuous. `t_eval`: ascending times, s. Returns arrays shaped like `t_eval`: time (s),
    position (m, + = lifted), velocity (m/s), temperature (degC), stress (Pa), martensite_fraction, strain (of the wire,
    from its start). Raises ValueError on times out of order.
    """

    def hung(mass: float) -> Load:
        return Load(ratio=1.0, inertia=mass, damping=params.damping, resistance=lambda _q: mass * GRAVITY)

    pieces = [(end, volts, hung(mass)) for end, volts, mass in segments]
    stress = segments[0][2] * GRAVITY / params.area
    out = _integrate(params, pieces, stress, 0.0, t_eval, rtol, method)
    return {"position": out.pop("q"), "velocity": out.pop("speed"), **out}


def _integrate(
    wire: WireParameters,
    segments: Sequence[tuple[float, Voltage, Load]],
    stress: float,
    start: float,
    t_eval: ArrayLike,
    rtol: float,
    method: str,
) -> dict[str, Vector]:
    """Piece by piece from event to event; arrays at `t_eval`, with q and speed for the load's coordinate."""
    times = np.asarray(t_eval, dtype=float)
    ends = [end for end, _, _ in segments]
    if np.any(np.diff(times) <= 0) or np.any(np.diff([0.0, *ends]) <= 0) or times[0] < 0 or times[-1] > ends[-1]:
        raise ValueError(
            f"times run {times[0]} to {times[-1]} s, segments end at {ends}; "
            "expected both ascending, from 0 and within the last segment; sort them or lengthen the last segment"
        )
    modes = Modes(wire, segments[0][2], rest_rate=1e3 * rtol)
    first = wire.ambient_temperature if wire.initial_temperature is None else wire.initial_temperature
    state = np.array([first, stress, start, 0.0, 0.0])
    modes.stop = -1 if start <= modes.load.low else 1 if start >= modes.load.high else 0
    kept = np.empty((6, times.size))
    done, now, count, step = 0, 0.0, 0, MAX_STEP
    for end, volts, load in segments:
        modes.volts, modes.load = volts if callable(volts) else _constant(volts), load
        state = modes.settle(now, state)
        while now < end:
            count += 1
            if count > MAX_EVENTS:
                raise RuntimeError(
                    f"{MAX_EVENTS} events by t = {now:.6g} s; expected far fewer; "
                    "the modes chatter, so shorten the run or check the parameters"
                )
            watched = modes.watch()
            functions = [_event(function, direction, True) for _, direction, function in watched]
            functions += [_event(function, direction, False) for direction, function in modes.peaks()]
            wanted = times[done : np.searchsorted(times, end, side="right")]
            piece = solve_ivp(
                lambda t, s: modes.rates(t, s)[:5],
                (now, end),
                state,
                method=method,
                max_step=step,
                rtol=rtol,
                atol=rtol * SCALES,
                t_eval=np.append(wanted[wanted < end], end),
                events=functions,
            )
            if piece.status < 0:
                raise RuntimeError(f"integration stopped at t = {now:.6g} s: {piece.message}; loosen rtol")
            if step > FINEST_STEP and any(modes.passed(s) for at in piece.y_events[len(watched) :] for s in at):
                step /= 10  # a contact was passed and left within one step: this piece again, closer
                continue
            step = MAX_STEP
            if len(piece.t):
                got = int(np.searchsorted(wanted, piece.t[-1], side="right"))
                kept[:5, done : done + got] = piece.y[:, :got]
                kept[5, done : done + got] = [modes.fraction(s) for s in piece.y.T[:got]]
                done += got
            hits = [(at[-1], i) for i, at in enumerate(piece.t_events[: len(watched)]) if at.size]
            if piece.status == 1 and hits:
                now, i = max(hits)
                state = modes.handle(watched[i][0], now, piece.y_events[i][-1].copy())
            else:
                now, state = end, piece.y[:, -1].copy()
    strain = -modes.load.ratio * (kept[2] - start) / wire.length - kept[4]
    return {
        "time": times,
        "q": kept[2],
        "speed": kept[3],
        "temperature": kept[0],
        "stress": np.maximum(kept[1], 0.0),
        "martensite_fraction": kept[5],
        "strain": strain,
    }


def _event(
    function: Callable[[float, Vector], float], direction: int, terminal: bool
) -> Callable[[float, Vector], float]:
    """A fresh callable with the flags solve_ivp reads."""

    def event(t: float, s: Vector) -> float:
        return function(t, s)

    event.terminal, event.direction = terminal, direction  # type: ignore[attr-defined]
    return event


def _constant(value: float) -> Callable[[float], float]:
    return lambda _t: value
