"""How strong an effect is: what of its change in the readings no refit of the base model takes up, in noises.

The refit is that of the unknowns of the experiment file, of the values of the sheet within their widths and of each run's zero,
on noise-free readings, by Levenberg and Marquardt's steps until they gain nothing. The root mean square of what is left over
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
Matrix = NDArray[np.float64]
TOLERANCE = 0.1  # of the strength asked for
TRIALS = 8
CLOSER = 0.7  # in logarithms, towards what can be simulated
DEGREES = 0.1  # steps of the derivatives: of a temperature, K
SHARE = 2e-3  # of all else
STEPS = 6  # tried with one set of derivatives, at most
RENEWED = 10  # times that the derivatives are taken anew where the refit has come to, at most
NOTHING = 0.05  # noises: a rest that counts as none
IDLE = 3  # steps that gain next to nothing, one after the other, end it
REJECTED, ACCEPTED = 5.0, 0.2  # times the damping after a step
ENOUGH = 0.8  # of the strength asked for: what leaves less is not refitted further, for it is too little
GAINED = 0.99  # a step that leaves more of the rest than this share gains next to nothing
ABSURD = 10.0  # times the rest: of a step that leaves so much nothing is learnt
FIRST_DAMPING = 1e-3  # of the derivatives' squares, each in its own size
# Of a simulation: ranges meet or vanish, or the modes chatter.
NO_SUCH_WIRE = (ValueError, RuntimeError, ZeroDivisionError, OverflowError)


@dataclass(frozen=True)
class Found:
    """Coefficient, the strength it has, and whether the largest coefficient that is physical, or can be simulated, ended the search."""

    coefficient: float
    strength: float
    capped: bool


@dataclass(frozen=True)
class Refit:
    """The wire that a refit came to, the derivatives it used last, what it leaves as a root mean square in noises, and half of what it made least."""

    wire: Wire
    slopes: Matrix
    left: float
    objective: float


class Ruler:
    """Measures the strength of effects on one rig with one wire; `widths`: of values that a refit may move, of the logarithm."""

    def __init__(self, rig: Rig, wire: Wire, widths: Mapping[str, float] = MappingProxyType({})) -> None:
        self.rig, self.wire = rig, wire
        self.names = (*rig.unknowns, *widths)
        self.spread = {name: width * getattr(wire, name) for name, width in widths.items()}
        self._values: dict[tuple[object, ...], list[Vector]] = {}  # a sensor's effects need no new simulation
        self.runs = [run for run in rig.runs(wire) if run.role == "fit"]
        self.null = self.readings(wire, {})
        self.slopes = self._slopes(wire, self.null)
        self.found: dict[str, Refit] = {}  # of each effect whose coefficient was sought

    def readings(self, wire: Wire, effects: Effects) -> Vector:
        """Noise-free readings of all fit runs, in noises."""
        behind = {name: c for name, c in effects.items() if EFFECTS[name].group != "sensor"}
        key = (wire, *sorted(behind.items()))
        if key not in self._values:
            self._values[key] = [value(self.rig, wire, run, behind) for run in self.runs]
        times, stroke = self.rig.clock.times, self.rig.stroke
        return np.concatenate([reading(times, x, effects, stroke) for x in self._values[key]]) / self.rig.noise

    def _slopes(self, wire: Wire, here: Vector) -> Matrix:
        """Derivatives of the rests by the values at a wire with these readings: a column each."""
        columns = []
        for name in self.names:
            step = DEGREES if name.endswith(("start", "finish")) else SHARE * getattr(self.wire, name)
            there = replace(wire, **{name: getattr(wire, name) + step})
            sheet = [float(one == name) / spread for one, spread in self.spread.items()]
            columns.append(np.concatenate([self._centred(self.readings(there, {}) - here) / step, sheet]))
        return np.column_stack(columns)

    def _centred(self, readings: Vector) -> Vector:
        """About each run's own mean: a run has a zero of its own."""
        by_run = readings.reshape(len(self.runs), -1)
        return (by_run - by_run.mean(axis=1, keepdims=True)).ravel()

    def rests(self, shown: Vector, wire: Wire) -> Vector:
        """What a wire leaves of the readings, and how far its values of the sheet are from the true ones, in widths."""
        off = [(getattr(self.wire, name) - getattr(wire, name)) / one for name, one in self.spread.items()]
        return np.concatenate([self._centred(shown - self.readings(wire, {})), off])

    def _left(self, rests: Vector) -> float:
        return float(np.sqrt(np.mean(rests[: self.null.size] ** 2)))

    def strength(self, effects: Effects) -> float:
        """Root mean square of what a refit leaves of the effects, in noises."""
        return self.refit(effects).left

    def together(self, effects: Effects) -> float:
        """The same of effects that were sought each alone: from the true wire, and from where their own refits come to together."""
        own = [self.found[name].wire for name in effects]
        refits = [self.refit(effects)]
        begin = self._moved(
            refits[0],
            {name: sum(getattr(one, name) - getattr(self.wire, name) for one in own) for name in self.names},
        )
        if begin is not None:
            refits.append(self.refit(effects, begin))
        return min(refits, key=lambda one: one.objective).left

    def refit(self, effects: Effects, begin: Refit | None = None, below: float = NOTHING) -> Refit:
        """The base model fitted to the readings with the effects, from the true wire or another; ended early where less than `below` is left."""
        shown = self.readings(self.wire, effects)
        wire, slopes = (self.wire, self.slopes) if begin is None else (begin.wire, begin.slopes)
        rests, damping = self.rests(shown, wire), FIRST_DAMPING
        of_here = begin is None  # whether the derivatives are those of the wire
        for renewed in range(RENEWED + 1):
            before = float(rests @ rests)
            wire, rests, damping = self._refitted(shown, wire, rests, slopes, damping, below)
            gained = float(rests @ rests) < GAINED**2 * before
            if renewed == RENEWED or self._left(rests) < below or (of_here and not gained):
                break
            try:
                slopes, of_here = self._slopes(wire, self.readings(wire, {})), True
            except NO_SUCH_WIRE:
                break
        return Refit(wire, slopes, self._left(rests), 0.5 * float(rests @ rests))

    def _refitted(  # of a refit all that it has
        self, shown: Vector, wire: Wire, rests: Vector, slopes: Matrix, damping: float, below: float
    ) -> tuple[Wire, Vector, float]:
        """Where the steps from a wire come to, its rests, and the damping; after each step the derivatives are corrected by what it did (Broyden)."""
        sizes = np.linalg.norm(slopes, axis=0)
        matrix = slopes / sizes
        idle = 0
        for _ in range(STEPS):
            normal = matrix.T @ matrix
            move = np.linalg.solve(normal + damping * np.eye(len(normal)), matrix.T @ rests)
            values = {name: getattr(wire, name) + float(d) for name, d in zip(self.names, move / sizes, strict=True)}
            there = replace(wire, **values)
            try:
                if not _possible(there):
                    raise ValueError("no such wire")
                new = self.rests(shown, there)
                if not self._left(new) < ABSURD * self._left(rests):
                    raise ValueError("no derivatives hold so far")
            except NO_SUCH_WIRE:
                damping *= REJECTED
                continue
            matrix = matrix + np.outer(rests - new - matrix @ move, move) / float(move @ move)
            least = float(rests @ rests)
            if float(new @ new) >= least:
                damping *= REJECTED
                continue
            idle = idle + 1 if float(new @ new) > GAINED**2 * least else 0
            wire, rests, damping = there, new, ACCEPTED * damping
            if self._left(rests) < below or idle == IDLE:
                break
        return wire, rests, damping

    def find(self, name: str, wanted: float, others: Mapping[str, float] | None = None) -> Found:
        """Coefficient of an effect at which its strength, beside `others`, is `wanted`; secant in logarithms."""
        effect, others = EFFECTS[name], others or {}
        sign, largest = math.copysign(1.0, effect.first), math.log(abs(effect.largest))

        def effects_of(size: float) -> Effects:
            return {**others, name: sign * math.exp(size)}

        refits: dict[float, Refit] = {}
        size, begin = min(math.log(abs(effect.first)), largest), None
        for _ in range(TRIALS):
            try:
                refits[size] = self._best(effects_of(size), begin, wanted)
            except NO_SUCH_WIRE:
                largest = size - CLOSER
                size, begin = largest, None
                continue
            missed = _missed(refits[size], wanted)
            if abs(missed) < TOLERANCE or (size == largest and missed < 0):
                break
            trials = [(one, _missed(refit, wanted)) for one, refit in refits.items()]
            following = min(_next(trials), largest)
            begin, size = self._scaled(refits[size], math.exp(following - size)), following
        if not refits:
            raise ValueError(
                f"{name} at {effect.first:g} cannot be simulated on {self.rig.name}; expected a smaller first"
            )
        size = min(refits, key=lambda one: abs(_missed(refits[one], wanted)))
        capped = all(_missed(refit, wanted) <= -TOLERANCE for refit in refits.values()) and largest in refits
        if capped:
            size = largest
        refit = refits[size]
        if refit.left < ENOUGH * wanted:  # not refitted to the end
            refit = self.refit(effects_of(size), refit)
        self.found[name] = refit
        return Found(sign * math.exp(size), refit.left, capped)

    def _best(self, effects: Effects, begin: Refit | None, wanted: float) -> Refit:
        """The better refit of those from about where another came to and from the true wire; one alone where it leaves too little."""
        below = ENOUGH * wanted
        first = self.refit(effects, begin, below)
        if begin is None or first.left < below:
            return first
        return min(first, self.refit(effects, None, below), key=lambda one: one.objective)

    def _scaled(self, refit: Refit, share: float) -> Refit | None:
        """About where a refit to effects of this share of the size comes to; None: no such wire."""
        return self._moved(
            refit, {name: share * (getattr(refit.wire, name) - getattr(self.wire, name)) for name in self.names}
        )

    def _moved(self, refit: Refit, moves: Mapping[str, float]) -> Refit | None:
        """`refit` at the true wire with its values moved by so much; None: no such wire."""
        wire = replace(self.wire, **{name: getattr(self.wire, name) + move for name, move in moves.items()})
        try:
            self.readings(wire, {})
        except NO_SUCH_WIRE:
            return None
        return replace(refit, wire=wire) if _possible(wire) else None


def _possible(wire: Wire) -> bool:
    """Whether a refit has stayed with wires that exist."""
    ranges = wire.austenite_finish - wire.austenite_start, wire.martensite_start - wire.martensite_finish
    rates = wire.convection_coefficient, wire.specific_heat, wire.recoverable_strain, wire.stress_slope_austenite
    apart = wire.austenite_finish > wire.martensite_start and wire.austenite_start > wire.martensite_finish
    return min(*ranges, *rates) > 0 and apart


def _missed(refit: Refit, wanted: float) -> float:
    """In logarithms."""
    return math.log(max(refit.left, 1e-9) / wanted)


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
