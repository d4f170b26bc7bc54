"""How strong an effect is: what of its change in the readings no refit of the base model takes up, in noises.

The refit is its linear part: the change is projected off the numerical derivatives of the readings to the unknowns of
the experiment file and to each run's zero; the root mean square of the rest over the noise is the strength.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.effects import EFFECTS
from studies.attribution_benchmark.parameters import Effects, Wire
from studies.attribution_benchmark.rigs import Rig, value
from studies.attribution_benchmark.sensor import reading

Vector = NDArray[np.float64]
TOLERANCE = 0.1  # of the strength asked for
TRIALS = 8
DEGREES = 0.1  # steps of the derivatives: of a temperature, K
SHARE = 2e-3  # of all else


@dataclass(frozen=True)
class Found:
    """Coefficient, the strength it has, and whether the largest physical coefficient stopped the search."""

    coefficient: float
    strength: float
    capped: bool


class Ruler:
    """Measures the strength of effects on one rig with one wire."""

    def __init__(self, rig: Rig, wire: Wire) -> None:
        self.rig, self.wire = rig, wire
        self._values: dict[tuple[object, ...], list[Vector]] = {}  # a sensor's effects need no new simulation
        self.runs = [run for run in rig.runs(wire) if run.role == "fit"]
        self.null = self.readings(wire, {})
        self.basis = np.linalg.qr(np.column_stack(self._columns()))[0]

    def readings(self, wire: Wire, effects: Effects) -> Vector:
        """Noise-free readings of all fit runs, in noises."""
        behind = {name: c for name, c in effects.items() if EFFECTS[name].group != "sensor"}
        key = (wire, *sorted(behind.items()))
        if key not in self._values:
            self._values[key] = [value(self.rig, wire, run, behind) for run in self.runs]
        times, stroke = self.rig.clock.times, self.rig.stroke
        return np.concatenate([reading(times, x, effects, stroke) for x in self._values[key]]) / self.rig.noise

    def _columns(self) -> list[Vector]:
        columns = []
        for name in self.rig.unknowns:
            nominal = getattr(self.wire, name)
            step = DEGREES if name.endswith(("start", "finish")) else SHARE * nominal
            column = (self.readings(replace(self.wire, **{name: nominal + step}), {}) - self.null) / step
            columns.append(column / np.linalg.norm(column))
        count = self.rig.clock.count
        for i in range(len(self.runs)):
            zero = np.zeros(self.null.size)
            zero[i * count : (i + 1) * count] = 1.0
            columns.append(zero)
        return columns

    def strength(self, effects: Effects) -> float:
        """Root mean square of what a refit leaves of the effects, in noises."""
        change = self.readings(self.wire, effects) - self.null
        rest = change - self.basis @ (self.basis.T @ change)
        return float(np.sqrt(np.mean(rest**2)))

    def find(self, name: str, wanted: float, others: Mapping[str, float] | None = None) -> Found:
        """Coefficient of an effect at which its strength, beside `others`, is `wanted`; secant in logarithms."""
        effect, others = EFFECTS[name], others or {}
        sign, largest = math.copysign(1.0, effect.first), math.log(abs(effect.largest))

        def miss(size: float) -> float:
            strength = self.strength({**others, name: sign * math.exp(size)})
            return math.log(max(strength, 1e-9) / wanted)

        trials: list[tuple[float, float]] = []
        size = min(math.log(abs(effect.first)), largest)
        for _ in range(TRIALS):
            trials.append((size, miss(size)))
            best = min(trials, key=lambda trial: abs(trial[1]))
            if abs(best[1]) < TOLERANCE or (size == largest and trials[-1][1] < 0):
                break
            size = min(_next(trials), largest)
        size, missed = min(trials, key=lambda trial: abs(trial[1]))
        return Found(sign * math.exp(size), wanted * math.exp(missed), size >= largest and missed < -TOLERANCE)


def _next(trials: list[tuple[float, float]]) -> float:
    """Where the secant through two trials meets zero: those around it if there are such, otherwise the nearest two."""
    low = max((t for t in trials if t[1] < 0), default=None)
    high = min((t for t in trials if t[1] >= 0), default=None)
    if low is not None and high is not None and low[0] < high[0]:
        share = min(max(-low[1] / (high[1] - low[1]), 0.1), 0.9)
        return low[0] + share * (high[0] - low[0])
    if len(trials) == 1:
        slope = 1.0
    else:
        a, b = sorted(trials, key=lambda trial: abs(trial[1]))[:2]
        slope = (a[1] - b[1]) / (a[0] - b[0]) if a[0] != b[0] else 1.0
    nearest = min(trials, key=lambda trial: abs(trial[1]))
    move = -nearest[1] / min(max(slope, 0.3), 3.0)
    return nearest[0] + min(max(move, -3.0), 3.0)
