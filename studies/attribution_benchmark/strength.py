"""How strong an effect is: what of its change in the readings no refit of the base model takes up, in noises.

The refit is that of the unknowns of the experiment file, of the values of the sheet within their widths and of each run's zero,
on noise-free readings, by steps of Gauss and Newton with the derivatives at the truth. The root mean square of what is left over
the noise is the strength.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.effects import EFFECTS
from studies.attribution_benchmark.parameters import Effects, Wire
from studies.attribution_benchmark.rigs import Rig, value
from studies.attribution_benchmark.sensor import reading

Vector = NDArray[np.float64]
TOLERANCE = 0.1  # of the strength asked for
TRIALS = 8
REFITS = 3  # steps at most
NOTHING = 0.05  # noises: a rest that counts as none
ENOUGH = 0.95  # a step that leaves more of the rest than this share is the last
CLOSER = 0.7  # in logarithms, towards what can be simulated
DEGREES = 0.1  # steps of the derivatives: of a temperature, K
SHARE = 2e-3  # of all else
# Of a simulation: ranges meet or vanish, or the modes chatter.
NO_SUCH_WIRE = (ValueError, RuntimeError, ZeroDivisionError)


@dataclass(frozen=True)
class Found:
    """Coefficient, the strength it has, and whether the largest physical coefficient stopped the search."""

    coefficient: float
    strength: float
    capped: bool


class Ruler:
    """Measures the strength of effects on one rig with one wire; `widths`: of values that a refit may move, of the logarithm."""

    def __init__(self, rig: Rig, wire: Wire, widths: Mapping[str, float] = MappingProxyType({})) -> None:
        self.rig, self.wire = rig, wire
        self.names = (*rig.unknowns, *widths)
        self.spread = {name: width * getattr(wire, name) for name, width in widths.items()}
        self._values: dict[tuple[object, ...], list[Vector]] = {}  # a sensor's effects need no new simulation
        self.runs = [run for run in rig.runs(wire) if run.role == "fit"]
        self.null = self.readings(wire, {})
        matrix = np.column_stack(self._columns())
        rows = np.zeros((len(widths), matrix.shape[1]))
        for row, (name, spread) in enumerate(self.spread.items()):
            rows[row, self.names.index(name)] = 1.0 / spread
        matrix = np.concatenate([matrix, rows])
        self.sizes = np.linalg.norm(matrix, axis=0)
        self.basis, self.corner = np.linalg.qr(matrix / self.sizes)

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
        for name in self.names:
            nominal = getattr(self.wire, name)
            step = DEGREES if name.endswith(("start", "finish")) else SHARE * nominal
            columns.append((self.readings(replace(self.wire, **{name: nominal + step}), {}) - self.null) / step)
        count = self.rig.clock.count
        for i in range(len(self.runs)):
            zero = np.zeros(self.null.size)
            zero[i * count : (i + 1) * count] = 1.0
            columns.append(zero)
        return columns

    def together(self, effects: Effects) -> float:
        """`strength` of several effects, by fewer steps of the refit where these end at wires that do not exist."""
        for refits in range(REFITS, 0, -1):
            try:
                return self.strength(effects, refits)
            except NO_SUCH_WIRE:
                continue
        return self.strength(effects, 0)

    def strength(self, effects: Effects, refits: int = REFITS) -> float:
        """Root mean square of what a refit by so many steps leaves of the effects, in noises."""
        shown = self.readings(self.wire, effects)
        wire, rest = self.wire, shown - self.null
        left = self._without_zeros(rest)
        for _ in range(refits):
            off = [(getattr(self.wire, name) - getattr(wire, name)) / one for name, one in self.spread.items()]
            move = np.linalg.solve(self.corner, self.basis.T @ np.concatenate([rest, off])) / self.sizes
            moved = {name: getattr(wire, name) + float(d) for name, d in zip(self.names, move, strict=False)}
            wire = replace(wire, **moved)
            if not _possible(wire):
                break
            rest = shown - self.readings(wire, {})
            now = self._without_zeros(rest)
            done, left = now > ENOUGH * left, min(now, left)
            if done or left < NOTHING:
                break
        return left

    def _without_zeros(self, rest: Vector) -> float:
        """Root mean square about each run's own mean."""
        by_run = rest.reshape(len(self.runs), -1)
        return float(np.sqrt(np.mean((by_run - by_run.mean(axis=1, keepdims=True)) ** 2)))

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
            try:
                trials.append((size, miss(size)))
            except NO_SUCH_WIRE:
                largest = size - CLOSER
                size = largest
                continue
            best = min(trials, key=lambda trial: abs(trial[1]))
            if abs(best[1]) < TOLERANCE or (size == largest and trials[-1][1] < 0):
                break
            size = min(_next(trials), largest)
        if not trials:
            raise ValueError(
                f"{name} at {effect.first:g} cannot be simulated on {self.rig.name}; expected a smaller first"
            )
        size, missed = min(trials, key=lambda trial: abs(trial[1]))
        return Found(sign * math.exp(size), wanted * math.exp(missed), size >= largest and missed < -TOLERANCE)


def _possible(wire: Wire) -> bool:
    """Whether a refit has stayed with wires that exist."""
    ranges = wire.austenite_finish - wire.austenite_start, wire.martensite_start - wire.martensite_finish
    rates = wire.convection_coefficient, wire.specific_heat, wire.recoverable_strain, wire.stress_slope_austenite
    apart = wire.austenite_finish > wire.martensite_start and wire.austenite_start > wire.martensite_finish
    return min(*ranges, *rates) > 0 and apart


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
