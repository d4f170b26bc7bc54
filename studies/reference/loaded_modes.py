"""A wire under a load with inertia, heated by a current: the modes of `law_modes` with the arm or the weight added."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from studies.reference.event_march import Function, Vector
from studies.reference.law_modes import Forcing, LawModes
from studies.reference.wire_law import Branch
from studies.reference.wire_modes import EVENT_GAP, Load
from studies.reference.wire_parameters import WireParameters


class LoadedModes(LawModes):
    """State (T, stress, q, q', gap, xi_s); `stop` is -1 or +1 while the load lies on its low or high stop."""

    def __init__(self, wire: WireParameters, load: Load, rest_rate: float) -> None:
        super().__init__(wire, rest_rate)
        self.load, self.stop = load, 0
        self.volts: Callable[[float], float] = lambda _t: 0.0
        self.mass = wire.density * wire.area if wire.mass_per_metre is None else wire.mass_per_metre
        self.surface = math.pi * wire.diameter if wire.surface_per_metre is None else wire.surface_per_metre

    def force(self, t: float, s: Sequence[float] | Vector, xi: float) -> Forcing:
        """Heat balance (eq. 3.1) and kinematics (eq. 3.7)."""
        w, excess = self.wire, float(s[0]) - self.wire.ambient_temperature
        resistance = w.resistance_austenite + xi * (w.resistance_martensite - w.resistance_austenite)
        convection = w.convection_coefficient * (1 + w.convection_slope * excess)
        heat = (w.electric_heat(self.volts(t), resistance) - convection * self.surface * excess) / self.mass
        strain_rate = 0.0 if self.stop else -self.load.ratio * float(s[3]) / w.length
        return Forcing(heat, strain_rate, capacity=w.specific_heat, latent=w.latent_heat)

    def rates(self, t: float, s: Vector) -> tuple[float, ...]:
        """Rates of the state (eqs. 3.8, 3.13)."""
        t_rate, stress_rate, own, detwinned_rate, _ = self.material(t, s)
        speed = 0.0 if self.stop else float(s[3])
        gap_rate = -self.load.ratio * speed / self.wire.length - own if self.slack else 0.0
        acceleration = 0.0 if self.stop else (self._net_force(s) - self.load.damping * speed) / self.load.inertia
        return t_rate, stress_rate, speed, acceleration, gap_rate, detwinned_rate

    def _net_force(self, s: Vector) -> float:
        return self.load.ratio * self.wire.area * float(s[1]) - self.load.resistance(float(s[2]))

    def settle(self, t: float, s: Vector, barred: Branch | str | None = None) -> Vector:
        """Let go of a stop that no longer holds, then as the wire does."""
        if self.stop and self.stop * self._net_force(s) < 0:
            self.stop = 0
        return super().settle(t, s, barred)

    def watch(self) -> list[tuple[str, int, Function]]:
        """The wire's events and those of the stops."""
        result, load = super().watch(), self.load
        if self.stop:
            result.append(("release", -self.stop, lambda t, s: self._net_force(s)))
        elif math.isfinite(load.low):
            result.append(("low", -1, lambda t, s: s[2] - load.low + EVENT_GAP))
            result.append(("high", 1, lambda t, s: s[2] - load.high - EVENT_GAP))
        return result

    def handle(self, name: str, t: float, s: Vector) -> Vector:
        """Switch the modes at an event; returns the state after it."""
        if name in ("low", "high"):
            s[3], self.stop = 0.0, -1 if name == "low" else 1
        elif name == "release":
            self.stop = 0
            return s
        return super().handle(name, t, s)
