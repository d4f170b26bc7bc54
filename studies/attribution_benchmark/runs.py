"""Excitations: what each run of a rig commands, held from one sample to the next.

Ramps and sines are staircases of the amplifier's update time: the log then says exactly what the wire was given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.parameters import Wire

Vector = NDArray[np.float64]
COOLED = 12.0  # K below the end of cooling


@dataclass(frozen=True)
class Run:
    """One run. `command`: V, duty or, of a coupon, degC; `other`: mass in kg or stress in Pa, where the rig has one."""

    name: str
    role: str  # "fit" or "held-out"
    command: Vector
    other: Vector | None = None


@dataclass(frozen=True)
class Clock:
    """Sampling of a rig: `step` s between samples, `update` of them between two commands of a ramp, `count` in all."""

    step: float
    update: int
    count: int

    @property
    def times(self) -> Vector:
        """Sample times, s."""
        return self.step * np.arange(self.count, dtype=float)

    @property
    def seconds(self) -> float:
        """Length of a run."""
        return (self.count - 1) * self.step

    def levels(self, *pairs: tuple[float, float]) -> Vector:
        """(share of the run, value) in turn, the last one held to the end."""
        ends = np.round(np.cumsum([share for share, _ in pairs]) * self.count)
        at = np.searchsorted(ends, np.arange(self.count), side="right")
        return np.array([value for _, value in pairs])[np.minimum(at, len(pairs) - 1)]

    def staircase(self, values: Vector) -> Vector:
        """Every `update`-th of the values, held."""
        return values[np.arange(self.count) // self.update * self.update]

    def ramps(self, *points: tuple[float, float]) -> Vector:
        """Straight lines through (share of the run, value), as a staircase."""
        share = np.arange(self.count) / (self.count - 1)
        return self.staircase(np.interp(share, [x for x, _ in points], [y for _, y in points]))

    def sines(self, mean: float, *waves: tuple[float, float, float]) -> Vector:
        """Sum of sines (amplitude, cycles in the run, decay over the run), as a staircase."""
        share = np.arange(self.count) / (self.count - 1)
        total = np.full(self.count, mean)
        for amplitude, cycles, decay in waves:
            total += amplitude * np.exp(-decay * share) * np.sin(2 * np.pi * cycles * share)
        return self.staircase(total)


def command(wire: Wire, temperature: Vector) -> Vector:
    """Command that holds a martensitic wire at a temperature, degC: V or duty, to a thousandth of the largest."""
    lost = wire.convection_coefficient * wire.surface * np.maximum(temperature - wire.ambient_temperature, 0.0)
    square = lost * wire.resistivity_martensite / wire.area * (wire.wire_length / wire.gain) ** 2
    value = square if wire.drive == "duty" else np.sqrt(square)
    unit = 10.0 ** math.floor(math.log10(value.max()) - 3)
    return np.round(value / unit) * unit


@dataclass(frozen=True)
class Marks:
    """Temperatures, degC, at which a wire under some stress begins and ends to transform; its time constant, s.

    `off` is where a run lets it cool to: not so far that it cools faster than the load can follow, and goes slack.
    """

    off: float
    start: float
    full: float
    back: float
    cold: float
    slow: float

    @staticmethod
    def of(wire: Wire, stress: float) -> Marks:
        """Marks of a wire that carries about `stress`, Pa."""
        up, down = stress / wire.stress_slope_austenite, stress / wire.stress_slope_martensite
        slow = wire.mass * wire.specific_heat / (wire.convection_coefficient * wire.surface)
        hot, cold = (wire.austenite_start + up, wire.austenite_finish + up), wire.martensite_finish + down
        return Marks(max(cold - COOLED, wire.ambient_temperature), *hot, wire.martensite_start + down, cold, slow)

    @property
    def middle(self) -> float:
        """Middle of the hysteresis."""
        return (self.start + self.full + self.back + self.cold) / 4

    def hot(self, share: float) -> float:
        """Temperature at a share of the range of heating."""
        return self.start + share * (self.full - self.start)

    def cool(self, share: float) -> float:
        """Temperature at a share of the range of cooling, 0 at its cold end."""
        return self.cold + share * (self.back - self.cold)


def powered(clock: Clock, wire: Wire, light: float, heavy: float, masses: Sequence[float] = ()) -> tuple[Run, ...]:
    """Runs of an electrically heated rig, tuned by the experimenter to the wire at hand; `light`, `heavy`: stresses, Pa.

    With `masses` (light, heavy) some runs carry the heavy one and a held-out one changes it under way.
    """
    m, h = Marks.of(wire, light), Marks.of(wire, heavy)

    def wave(amplitude: float, cycles: float, decay: float) -> tuple[float, float, float]:
        return amplitude * math.hypot(1.0, 2 * math.pi * cycles / clock.seconds * m.slow), cycles, decay

    def run(name: str, role: str, temperature: Vector, mass: Vector | None) -> Run:
        return Run(name, role, command(wire, temperature), mass)

    steps = clock.levels(
        (0.03, m.off), (0.22, m.full + 8), (0.2, m.off), (0.2, m.hot(0.5)), (0.15, m.full + 12), (0.2, m.off)
    )
    rungs = [
        h.start - 4,
        *map(h.hot, (0.3, 0.6, 0.9)),
        *map(h.cool, (0.8, 0.5, 0.3)),
        *map(h.hot, (0.4, 0.8)),
        h.cold - 5,
    ]
    ladder = clock.levels(*[(0.1, rung) for rung in rungs])
    triangle = clock.ramps((0, m.off), (0.35, m.full + 12), (0.65, m.cold - 10), (0.85, m.hot(0.5)), (1, m.cold - 10))
    loops = clock.sines(m.middle, wave(0.5 * (m.full - m.cold) + 6, 5, 1.2))
    bursts = [pair for on in (0.07, 0.1, 0.14) for pair in ((on, h.full + 12), (0.12, m.cold - 12))]
    pulses = clock.levels(*bursts, (0.13, h.full), (1, m.off))
    mixed = clock.sines(h.middle, wave(0.42 * (h.full - h.cold), 3, 0), wave(0.3 * (h.full - h.cold), 7, 0))
    carried, lifted, swapped = None, None, None
    if masses:
        carried, lifted = np.full(clock.count, masses[0]), np.full(clock.count, masses[1])
        swapped = clock.levels((0.4, masses[1]), (0.2, masses[0]), (0.2, masses[1]), (0.2, masses[0]))
    return (
        run("steps", "fit", steps, carried),
        run("ladder", "fit", ladder, lifted),
        run("triangle", "fit", triangle, carried),
        run("loops", "fit", loops, carried),
        run("pulses", "held-out", pulses, swapped),
        run("mixed", "held-out", mixed, lifted),
    )


def heated(clock: Clock, cold: float, hot: float, stresses: Sequence[float]) -> tuple[Run, ...]:
    """Runs of a coupon in an oven at constant stress (four, for fit, fit, fit and held-out), the last with inner loops."""

    def oven(*points: tuple[float, float]) -> Vector:
        share = np.arange(clock.count) / (clock.count - 1)
        return np.interp(share, [x for x, _ in points], [cold + y * (hot - cold) for _, y in points])

    whole = oven((0, 0), (0.5, 1), (1, 0))
    twice = oven((0, 0), (0.2, 1), (0.45, 0), (0.65, 0.55), (1, 0))
    inner = oven((0, 0), (0.22, 0.62), (0.38, 0.3), (0.55, 0.72), (0.72, 0.38), (0.86, 0.6), (1, 0.05))
    nested = oven((0, 0), (0.2, 1), (0.4, 0.28), (0.56, 0.66), (0.7, 0.36), (0.82, 0.58), (1, 0))

    def run(name: str, role: str, path: Vector, stress: float) -> Run:
        return Run(name, role, path, np.full(clock.count, stress))

    return (
        run("low", "fit", whole, stresses[0]),
        run("middle", "fit", twice, stresses[1]),
        run("high", "fit", whole, stresses[2]),
        run("inner", "fit", inner, stresses[1]),
        run("between", "held-out", whole, stresses[3]),
        run("nested", "held-out", nested, stresses[3]),
    )
