"""Modes, rates and events of the reference integration: which branch transforms, which stop holds, slack or taut.

Between events every mode is smooth. Inside an active branch the martensite fraction xi is an
algebraic function of temperature T and stress, xi = f(y), y = T - stress/C, so the rates of T, stress and xi follow
from three linear equations, with G = df/dy <= 0:

    stress' - theta_T T' - Omega xi' = E(xi) strain'       rate form, eq. 3.2, Omega = -E(xi) eps_L
    m c_p T' - m dH xi'              = P - h A_c (T - T_inf)  heat, eq. 3.1, with latent heat dH where wanted
    xi' - G (T' - stress'/C)         = 0                   kinetics, eqs. 3.3 and 3.5

1 + G Omega/C >= 1, so they always have one solution, and y' has the same sign whether or not its branch is active:
the conditions 3.17 and 3.18 need no guess of the mode. Events: branch contact, completion and reversal, end stops,
slack, input changes. SI units, temperature in degrees Celsius, angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from studies.reference.wire_parameters import WireParameters

Vector = NDArray[np.float64]
EVENT_GAP = 1e-9  # degC, rad: keeps an event just handled from firing again on rounding


@dataclass(frozen=True)
class Load:
    """Inertia q'' = ratio A_w stress - damping q' - resistance(q), strain' = -ratio q'/length, low <= q <= high."""

    ratio: float
    inertia: float
    damping: float
    resistance: Callable[[float], float]
    low: float = -math.inf
    high: float = math.inf


@dataclass
class Modes:
    """One run: state (T, stress, q, q', gap) and the discrete modes. gap: geometry strain minus wire strain, <= 0."""

    wire: WireParameters
    load: Load
    rest_rate: float = 1e-6  # K/s: what is slower is rest; at rest a rate's sign is only integration error
    volts: Callable[[float], float] = field(default=lambda _t: 0.0)
    phase: int = 0  # +1 heating branch transforms, -1 cooling branch transforms, 0 neither
    stop: int = 0  # -1 lying on the low stop, +1 on the high one
    slack: bool = False
    xi: float = 1.0  # held value while phase is 0
    xi_m: float = 1.0  # carried amplitude of the heating branch
    xi_a: float = 0.0  # carried foot of the cooling branch
    contact_a: float = math.inf  # y_A at which heating resumes transformation
    contact_m: float = -math.inf
    sense: int = 0  # Liang only: +1 warming, -1 cooling

    def __post_init__(self) -> None:
        w = self.wire
        self.mass = w.density * w.area if w.mass_per_metre is None else w.mass_per_metre
        self.surface = math.pi * w.diameter if w.surface_per_metre is None else w.surface_per_metre
        self.xi, self.liang = w.initial_martensite_fraction, w.conditions == "liang"
        if self.xi > 0:
            self.contact_a = w.austenite_start + self._span_a * math.acos(2 * self.xi - 1) / math.pi
        if self.xi < 1:
            self.contact_m = w.martensite_finish + self._span_m * math.acos(2 * self.xi - 1) / math.pi

    @property
    def _span_a(self) -> float:
        return self.wire.austenite_finish - self.wire.austenite_start

    @property
    def _span_m(self) -> float:
        return self.wire.martensite_start - self.wire.martensite_finish

    def _y(self, s: Sequence[float] | Vector) -> tuple[float, float]:
        return s[0] - s[1] / self.wire.austenite_slope, s[0] - s[1] / self.wire.martensite_slope

    def _h(self, y_a: float) -> float:
        return (1 + math.cos(math.pi * min(max((y_a - self.wire.austenite_start) / self._span_a, 0), 1))) / 2

    def _k(self, y_m: float) -> float:
        return (1 - math.cos(math.pi * min(max((y_m - self.wire.martensite_finish) / self._span_m, 0), 1))) / 2

    def fraction(self, s: Sequence[float] | Vector) -> float:
        """Martensite fraction in the present mode (eqs. 3.3, 3.5)."""
        if self.phase > 0:
            return self.xi_m * self._h(self._y(s)[0])
        return 1 - (1 - self.xi_a) * self._k(self._y(s)[1]) if self.phase < 0 else self.xi

    def rates(self, t: float, s: Sequence[float] | Vector, hold: bool = False) -> tuple[float, ...]:
        """(T', stress', q', q'', gap', xi'); hold: as if no branch were transforming."""
        w, load, phase = self.wire, self.load, 0 if hold else self.phase
        temperature, stress, speed = float(s[0]), float(s[1]), float(s[3])
        xi = self.fraction(s)
        slope, c = 0.0, w.austenite_slope if self.phase > 0 else w.martensite_slope
        if phase > 0:
            u = (temperature - stress / c - w.austenite_start) / self._span_a
            slope = -self.xi_m * math.pi / (2 * self._span_a) * math.sin(math.pi * min(max(u, 0), 1))
        elif phase < 0:
            u = (temperature - stress / c - w.martensite_finish) / self._span_m
            slope = -(1 - self.xi_a) * math.pi / (2 * self._span_m) * math.sin(math.pi * min(max(u, 0), 1))
        modulus = w.modulus_austenite + xi * (w.modulus_martensite - w.modulus_austenite)
        omega = -modulus * w.recoverable_strain
        resistance = w.resistance_austenite + xi * (w.resistance_martensite - w.resistance_austenite)
        excess = temperature - w.ambient_temperature
        convection = w.convection_coefficient * (1 + w.convection_slope * excess)
        heat = (w.electric_heat(self.volts(t), resistance) - convection * self.surface * excess) / self.mass
        speed = 0.0 if self.stop else speed
        strain_rate = -load.ratio * speed / w.length
        if self.slack:
            t_rate = heat / (w.specific_heat - w.latent_heat * slope)
            xi_rate, stress_rate = slope * t_rate, 0.0
            gap_rate = strain_rate + (w.thermoelastic_coefficient * t_rate + omega * xi_rate) / modulus
        else:
            g = slope / (1 + slope * omega / c)
            a, push = 1 - w.thermoelastic_coefficient / c, modulus * strain_rate / c
            t_rate = (heat - w.latent_heat * g * push) / (w.specific_heat - w.latent_heat * g * a)
            xi_rate, gap_rate = g * (a * t_rate - push), 0.0
            stress_rate = modulus * strain_rate + w.thermoelastic_coefficient * t_rate + omega * xi_rate
        acceleration = 0.0 if self.stop else (self.net_force(s) - load.damping * speed) / load.inertia
        return t_rate, stress_rate, speed, acceleration, gap_rate, xi_rate

    def net_force(self, s: Sequence[float] | Vector) -> float:
        """Generalised force of the wire less the load's resistance, without damping."""
        return self.load.ratio * self.wire.area * float(s[1]) - self.load.resistance(float(s[2]))

    def _y_rate(self, t: float, s: Vector) -> float:
        r = self.rates(t, s)
        return r[0] - r[1] / (self.wire.austenite_slope if self.phase > 0 else self.wire.martensite_slope)

    def _leave_branch(self, s: Vector) -> None:
        """Freeze xi and renew the other branch's carried value (3.26, corrected) and both contact points."""
        if self.phase == 0:
            return
        w, self.xi, (y_a, y_m) = self.wire, self.fraction(s), self._y(s)
        h, k = self._h(y_a), self._k(y_m)
        if (self.phase > 0 and k <= 0) or (self.phase < 0 and h <= 0):
            raise ValueError(
                f"both branches transform at T = {s[0]:.2f} degC, stress = {s[1]:.3e} Pa; "
                "expected the austenite range above the martensite one; check the four temperatures and two slopes"
            )
        if self.phase > 0:
            self.xi_a = 1 - (1 - self.xi) / k
        else:
            self.xi_m = self.xi / h
        self.contact_a = max(y_a, w.austenite_start) if self.xi > 0 else math.inf
        self.contact_m = min(y_m, w.martensite_start) if self.xi < 1 else -math.inf
        self.phase = 0

    def settle(self, t: float, s: Vector, sense: int | None = None) -> Vector:
        """Choose the modes anew after something jumped; `sense`: sign of T' where an event has just found it."""
        self._leave_branch(s)
        if self.stop and self.stop * self.net_force(s) < 0:
            self.stop = 0
        if self.liang:
            warming = self.rates(t, s, hold=True)[0]
            self.sense = (warming > 2 * self.rest_rate) - (warming < -2 * self.rest_rate) if sense is None else sense
        y_a, y_m = self._y(s)
        if self.may(1) and y_a > self.contact_a + 2 * EVENT_GAP:
            s = self._jump(s, 1)
        elif self.may(-1) and y_m < self.contact_m - 2 * EVENT_GAP:
            s = self._jump(s, -1)
        y_a, y_m = self._y(s)
        r = self.rates(t, s, hold=True)
        at_a, at_m = abs(y_a - self.contact_a) <= 2 * EVENT_GAP, abs(y_m - self.contact_m) <= 2 * EVENT_GAP
        if self.may(1) and at_a and r[0] - r[1] / self.wire.austenite_slope > 0:
            self.phase = 1
        elif self.may(-1) and at_m and r[0] - r[1] / self.wire.martensite_slope < 0:
            self.phase = -1
        else:  # on a contact but not driven: put it a hair ahead, or it would fire without end
            self.contact_a = y_a + EVENT_GAP if at_a else self.contact_a
            self.contact_m = y_m - EVENT_GAP if at_m else self.contact_m
        return s

    def may(self, branch: int) -> bool:
        """Whether the conditions let a branch (+1 heating, -1 cooling) transform, apart from its own y'.

        Liang's T' is taken without the latent heat: with it the branch would switch itself off and on without end.
        """
        return not self.liang or self.sense == branch

    def _jump(self, s: Vector, phase: int) -> Vector:
        """xi moves at once onto a curve already passed (Liang's switched-off branch, a hot start); the strain is held."""
        w, xi0 = self.wire, self.xi

        def moved(xi: float) -> Vector:
            new, d_t = s.copy(), w.latent_heat / w.specific_heat * (xi - xi0)
            mean = w.modulus_austenite + (xi + xi0) / 2 * (w.modulus_martensite - w.modulus_austenite)
            new[0] += d_t
            if self.slack:
                new[4] += w.thermoelastic_coefficient * d_t / mean - w.recoverable_strain * (xi - xi0)
            else:
                new[1] += w.thermoelastic_coefficient * d_t - mean * w.recoverable_strain * (xi - xi0)
            return new

        def miss(xi: float) -> float:
            y_a, y_m = self._y(moved(xi))
            return xi - (self.xi_m * self._h(y_a) if phase > 0 else 1 - (1 - self.xi_a) * self._k(y_m))

        self.xi = float(brentq(miss, 0.0 if phase > 0 else xi0, xi0 if phase > 0 else 1.0, xtol=1e-15))
        s, self.phase = moved(self.xi), phase
        self._leave_branch(s)
        return s

    def watch(self) -> list[tuple[str, int, Callable[[float, Vector], float]]]:
        """(name, direction, function) of each event that can end the present mode."""
        w = self.wire
        result: list[tuple[str, int, Callable[[float, Vector], float]]] = []
        if self.slack:
            result.append(("taut", 1, lambda t, s: s[4] - 1e-13))
        else:
            result.append(("slack", -1, lambda t, s: s[1] + 0.1))
        if self.stop:
            result.append(("release", -self.stop, lambda t, s: self.net_force(s)))
        elif math.isfinite(self.load.low):
            result.append(("low", -1, lambda t, s: s[2] - self.load.low + EVENT_GAP))
            result.append(("high", 1, lambda t, s: s[2] - self.load.high - EVENT_GAP))
        if self.phase:
            rest = -self.phase * self.rest_rate
            result.append(("reverse", -self.phase, lambda t, s: self._y_rate(t, s) - rest))
            end = w.austenite_finish if self.phase > 0 else w.martensite_finish
            result.append(("complete", self.phase, lambda t, s: self._y(s)[0 if self.phase > 0 else 1] - end))
        else:
            if math.isfinite(self.contact_a) and self.may(1):
                result.append(("contact", 1, lambda t, s: self._y(s)[0] - self.contact_a))
            if math.isfinite(self.contact_m) and self.may(-1):
                result.append(("contact", -1, lambda t, s: self._y(s)[1] - self.contact_m))
        if self.liang and self.sense:
            still = self.sense * self.rest_rate
            result.append(("rest", -self.sense, lambda t, s: self.rates(t, s, hold=True)[0] - still))
        elif self.liang:
            result.append(("warming", 1, lambda t, s: self.rates(t, s, hold=True)[0] - 2 * self.rest_rate))
            result.append(("cooling", -1, lambda t, s: self.rates(t, s, hold=True)[0] + 2 * self.rest_rate))
        return result

    def peaks(self) -> list[tuple[int, Callable[[float, Vector], float]]]:
        """(direction, function) of each turning of y while held: a contact passed and left in one step shows there."""
        w = self.wire
        result: list[tuple[int, Callable[[float, Vector], float]]] = []
        for branch, slope in ((1, w.austenite_slope), (-1, w.martensite_slope)):
            if self.phase == 0 and self.may(branch):
                result.append((-branch, _turning(self, slope, -2 * branch * self.rest_rate)))
        return result

    def passed(self, s: Vector) -> bool:
        """Whether a state lies beyond a contact that should have ended the held mode."""
        y_a, y_m = self._y(s)
        return y_a > self.contact_a + EVENT_GAP or y_m < self.contact_m - EVENT_GAP

    def handle(self, name: str, t: float, s: Vector) -> Vector:
        """Switch the modes at an event; returns the state after it."""
        if name == "reverse":
            # Straight to hold, contact a hair ahead: at the turning point the sign of the rate is rounding.
            was = self.phase
            self._leave_branch(s)
            if was > 0:
                self.contact_a += EVENT_GAP
            else:
                self.contact_m -= EVENT_GAP
            return s
        if name in ("warming", "cooling", "rest"):
            return self.settle(t, s, {"warming": 1, "cooling": -1, "rest": 0}[name])
        if name in ("low", "high"):
            s[3], self.stop = 0.0, -1 if name == "low" else 1
        elif name == "release":
            self.stop = 0
            return s
        elif name in ("slack", "taut"):
            s[1], s[4], self.slack = 0.0, 0.0, name == "slack"
        elif name == "complete":
            self._leave_branch(s)
        return self.settle(t, s)


def _turning(modes: Modes, slope: float, level: float) -> Callable[[float, Vector], float]:
    def turning(t: float, s: Vector) -> float:
        r = modes.rates(t, s)
        return r[0] - r[1] / slope - level

    return turning
