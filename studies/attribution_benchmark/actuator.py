"""Rates, modes and events of a wire on a load, with the effects of the truth.

Inside an active branch xi is algebraic in temperature T and stress, so T', stress' and xi' follow from three linear
equations (G = amplitude * slope of the curve, per degree; k = -(dz/dstress)/(dz/dT), 1/C in the base model):

    (1 + E gamma) stress' = E (strain' - delta) + (theta_T - E alpha) T' - E eps xi'       eq. 3.2 in rate form
    m c_p T' - m dH xi'   = P - loss                                                       eq. 3.1
    xi'                   = G (T' - k stress')                                             eq. 3.3, 3.5

alpha, gamma, delta: strains of `mechanics.Strains` per degree, per pascal, per second. Events switch the modes: contact,
completion and reversal of a branch, slack, end stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.heat import CLAMP_TIME, SAG_TIME, Electricity, Heat
from studies.attribution_benchmark.kinetics import Branch, branches
from studies.attribution_benchmark.mechanics import Mechanics, Strains
from studies.attribution_benchmark.parameters import Effects, Load, Wire

Vector = NDArray[np.float64]
Event = tuple[str, int, Callable[[float, Vector], float]]
GAP = 1e-9  # of progress and of positions: keeps an event just handled from firing again on rounding
DONE = 1e-12  # fraction below which a branch has nothing left to transform
REST = 2e-5  # K/s: below it a rate is rest
CLAMP_COUPLING = 0.5  # share of the clamp's own loss against what the wire gives it
STATES = ("temperature", "stress", "position", "velocity", "gap")
EXTRAS = {  # further states, and the effects that need them
    "friction": ("coulomb_friction", "stribeck_friction"),
    "creep": ("creep",),
    "late_temperature": ("rate_dependence",),
    "late_stress": ("rate_dependence",),
    "clamp": ("clamp_node",),
    "sag": ("supply_sag",),
    "done": ("transformation_drift",),
}
SCALES = {"temperature": 1.0, "stress": 1e6, "position": 1e-2, "velocity": 1e-2, "gap": 1e-4, "creep": 1e-4}
SCALES |= {"friction": 1e-2, "late_temperature": 1.0, "late_stress": 1e6, "clamp": 1.0, "sag": 1e-1, "done": 1e-1}


class Actuator:
    """One run: the discrete modes, and the rates of the state between their switches."""

    def __init__(self, wire: Wire, load: Load, effects: Effects, seconds: float, largest: float, level: float) -> None:
        effects = {name: value for name, value in effects.items() if value != 0}
        self.names = STATES + tuple(n for n, needs in EXTRAS.items() if any(e in effects for e in needs))
        self.at = {name: i for i, name in enumerate(self.names)}
        self.wire, self.load, self.effects = wire, load, effects
        self.command = 0.0
        self.heat, self.electricity = Heat(wire, effects, seconds), Electricity(wire, effects, largest)
        self.mechanics, self.strains = Mechanics(wire, load, effects), Strains(wire, effects)
        self.branches = branches(wire, effects, level)
        self.lag = effects.get("rate_dependence", 0.0)
        self.share = 1.0 - effects.get("stress_rate_share", 0.0)  # of the stress rate in eq. 3.17, 3.18; 1: as printed
        self.active: Branch | None = None
        self.xi = 1.0
        self.gate = 0  # where the share is not 1: the branch (+1, -1) that the conditions allow
        self.slack = effects.get("slack", 0.0) > 0
        self.stop = -1 if load.start <= load.low else 0

    def start(self) -> Vector:
        """At rest, at ambient temperature, all martensite."""
        w, load = self.wire, self.load
        first = dict.fromkeys(self.names, 0.0)
        first["temperature"] = first["late_temperature"] = w.ambient_temperature
        stress = 0.0 if self.slack else load.resistance(load.start) / (load.ratio * w.area)
        first["stress"] = first["late_stress"] = stress
        first["position"], first["gap"] = load.start, -self.effects.get("slack", 0.0)
        if "creep" in self.at:
            first["creep"] = self.strains.creep * stress / self.strains.level
        return np.array([first[name] for name in self.names])

    def scales(self) -> Vector:
        """Size of each state, for absolute tolerances."""
        return np.array([SCALES[name] for name in self.names])

    def _driver(self, s: Sequence[float] | Vector) -> tuple[float, float, float]:
        """Temperature, stress and transformations done, as the kinetics see them."""
        at = self.at
        done = float(s[at["done"]]) if "done" in at else 0.0
        if self.lag:
            return float(s[at["late_temperature"]]), float(s[at["late_stress"]]), done
        return float(s[0]), float(s[1]), done

    def fraction(self, s: Sequence[float] | Vector) -> float:
        """Martensite fraction in the present mode."""
        b = self.active
        if b is None:
            return self.xi
        share = b.curve.at(b.progress(*self._driver(s))[0])[0]
        return b.left(min(max(b.amplitude * share, 0.0), 1.0))

    def full_rates(
        self, t: float, state: Sequence[float] | Vector, hold: bool = False
    ) -> tuple[list[float], float, float]:
        """Rates of the state, xi', and W/m lost; hold: as if no branch transformed."""
        w, load, at, b = self.wire, self.load, self.at, None if hold else self.active
        s = state.tolist() if isinstance(state, np.ndarray) else [float(x) for x in state]
        temperature, stress, v = s[0], s[1], s[3]
        out = [0.0] * len(s)
        xi, slope, k, drift = self.xi, 0.0, 0.0, 0.0
        if b is not None:
            z, by_temperature, by_stress, by_done = b.progress(*self._driver(s))
            share, steepness = b.curve.at(z)
            xi = b.left(min(max(b.amplitude * share, 0.0), 1.0))
            slope = b.sign * b.amplitude * steepness * by_temperature
            k, drift = -by_stress / by_temperature, -b.sign * by_done / by_temperature  # |xi'| = -sign xi'
        e = w.modulus(xi)
        sign = 0 if b is None else b.sign
        eps, alpha, delta = self.strains.per_fraction(xi, stress, sign), self.strains.expansion, 0.0
        if self.strains.mismatch:
            eps += self.strains.softening(xi, stress, temperature)
        if "creep" in at:
            delta = out[at["creep"]] = self.strains.creep_rate(s[at["creep"]], stress, xi)
        power, current = self.electricity.power(self.command, temperature, xi, s[at["sag"]] if "sag" in at else 0.0)
        if "sag" in at:
            out[at["sag"]] = (current - s[at["sag"]]) / SAG_TIME
        clamp = s[at["clamp"]] if "clamp" in at else 0.0
        lost = self.heat.loss(t, temperature, clamp)
        if "clamp" in at:
            out[at["clamp"]] = (temperature - self.heat.ambient - clamp - CLAMP_COUPLING * clamp) / CLAMP_TIME
        heat, capacity, latent = power - lost, self.heat.heat_capacity(xi), self.heat.latent
        speed = 0.0 if self.stop else v
        strain_rate = -load.ratio * speed / w.wire_length
        theta = w.thermal_modulus - e * alpha
        n = 1 + e * self.strains.compliance
        if self.lag:  # the kinetics see a late temperature and stress, so xi' is known beforehand
            i, j = at["late_temperature"], at["late_stress"]
            out[i], out[j] = (temperature - s[i]) / self.lag, (stress - s[j]) / self.lag
            known = slope * (out[i] - k * out[j])
            known, slope = known / (1 - slope * drift), 0.0
        else:
            known, slope = 0.0, slope / (1 - slope * drift)
        if self.slack:
            t_rate = (heat + latent * known) / (capacity - latent * slope)
            xi_rate, stress_rate = slope * t_rate + known, 0.0
            out[4] = strain_rate - delta + (theta * t_rate - e * eps * xi_rate) / e
        else:
            push = e * (strain_rate - delta) / n
            # xi' = slope (T' - k stress') + known, stress' = push + theta T'/n - e eps xi'/n
            g = slope / (1 - slope * k * e * eps / n)
            a = 1 - k * theta / n
            late = known / (1 - slope * k * e * eps / n)
            t_rate = (heat + latent * (late - g * k * push)) / (capacity - latent * g * a)
            xi_rate = g * (a * t_rate - k * push) + late
            stress_rate = push + (theta * t_rate - e * eps * xi_rate) / n
        out[0], out[1], out[2] = t_rate, stress_rate, speed
        if "done" in at:
            # not |xi'|: where the branch is to turn back, that would count as progress and hide it from `_paces`
            out[at["done"]] = 0.0 if b is None else -b.sign * xi_rate
        if not self.stop:
            out[3] = (self.net_force(s) - load.damping * v) / load.inertia
            if "friction" in at:
                out[at["friction"]] = self.mechanics.friction_rate(s[at["friction"]], v)
        return out, xi_rate, lost

    def rates(self, t: float, s: Sequence[float] | Vector) -> list[float]:
        """Rates of the state."""
        return self.full_rates(t, s)[0]

    def net_force(self, s: Sequence[float] | Vector) -> float:
        """Generalised force of the wire less the load's, without damping."""
        q = float(s[2])
        force = self.load.ratio * self.wire.area * float(s[1]) - self.load.resistance(q) - self.mechanics.resistance(q)
        return force - float(s[self.at["friction"]]) if "friction" in self.at else force

    def _paces(self, t: float, s: Sequence[float] | Vector, hold: bool = False) -> tuple[float, float]:
        """Rates of the two branches' progress times their spans, K/s: positive where a branch would transform."""
        rates = self.full_rates(t, s, hold)[0]
        driver, at = self._driver(s), self.at
        d_t, d_s = (rates[at["late_temperature"]], rates[at["late_stress"]]) if self.lag else (rates[0], rates[1])
        done = rates[at["done"]] if "done" in at else 0.0
        found = []
        for b in self.branches:
            _, by_temperature, by_stress, by_done = b.progress(*driver)
            found.append((by_temperature * d_t + by_stress * d_s + by_done * done) * b.span)
        return found[0], found[1]

    def _condition(self, t: float, s: Sequence[float] | Vector) -> float:
        """T' - share stress'/C (eq. 3.17), where the share is not 1: stress' of the load at rest in its guide.

        That of the wire itself holds the load's vibration, and jumps with the branch: the branch would switch itself off.
        """
        load = self.load
        q, v = float(s[2]), 0.0 if self.stop else float(s[3])
        stress_rate = load.resistance_slope(q) * v / (load.ratio * self.wire.area)
        return self.full_rates(t, s, hold=True)[0][0] - self.share * stress_rate / self.wire.stress_slope_austenite

    def may(self, branch: Branch) -> bool:
        """Whether the conditions let a branch transform, apart from its own progress."""
        return self.share == 1.0 or self.gate == branch.sign

    def _leave(self, s: Vector) -> None:
        """Freeze xi, renew the other branch, set both contacts."""
        left = self.active
        if left is None:
            return
        self.xi, self.active = self.fraction(s), None
        if left.left(self.xi) < DONE:
            self.xi = left.left(0.0)
        driver = self._driver(s)
        left.touch(left.progress(*driver)[0], self.xi)
        self.branches[left.sign > 0].renew(*driver, self.xi)

    def settle(self, t: float, s: Vector, barred: Branch | None = None) -> Vector:
        """Choose the modes anew after something jumped; `barred`: a branch that has just ended."""
        self._leave(s)
        if self.stop and self.stop * self.net_force(s) < 0:
            self.stop = 0
        if self.share != 1.0:
            condition = self._condition(t, s)
            self.gate = int(condition > 1.5 * REST) - int(condition < -1.5 * REST)
        driver, paces = self._driver(s), self._paces(t, s, hold=True)
        for b, pace in zip(self.branches, paces, strict=True):
            z = b.progress(*driver)[0]
            if self.share != 1.0 and self.may(b) and z > b.contact + GAP and b.left(self.xi) > 0:
                share = b.curve.at(z)[0]
                if share > 0:  # passed while the conditions held it off: on from the present state
                    b.amplitude, b.contact = b.left(self.xi) / share, z
            if abs(z - b.contact) > 2 * GAP:
                continue
            if self.active is None and b is not barred and pace > 0 and self.may(b):
                self.active = b
            else:
                b.contact = z + GAP
        return s

    def watch(self) -> list[Event]:
        """(name, direction, function) of each event that can end the present mode."""
        found: list[Event] = []
        if self.slack:
            found.append(("taut", 1, lambda _t, s: s[4] - 1e-13))
        else:
            found.append(("slack", -1, lambda _t, s: s[1] + 0.1))
        if self.stop:
            found.append(("release", -self.stop, lambda _t, s: self.net_force(s)))
        else:
            if math.isfinite(self.load.low):
                found.append(("low", -1, lambda _t, s: s[2] - self.load.low + GAP))
            if math.isfinite(self.load.high):
                found.append(("high", 1, lambda _t, s: s[2] - self.load.high - GAP))
        b = self.active
        if b is not None:
            i, high = self.branches.index(b), b.curve.high
            found.append(("reverse", -1, lambda t, s: self._paces(t, s)[i] + REST))
            found.append(("complete", 1, lambda _t, s: b.progress(*self._driver(s))[0] - high))
        else:
            found += [
                ("contact", 1, _ahead(self, b)) for b in self.branches if math.isfinite(b.contact) and self.may(b)
            ]
        if self.share != 1.0:
            for side in {-1, 0, 1} - {self.gate}:
                level, direction = _gate_level(self.gate, side)
                found.append((f"gate{side}", direction, _above(self, level)))
        return found

    def peaks(self) -> list[tuple[int, Callable[[float, Vector], float]]]:
        """(direction, function) of each turning while held: a contact passed and left in one step shows there."""
        if self.active is not None:
            return []
        return [(-1, _turning(self, i)) for i in (0, 1) if self.may(self.branches[i])]

    def passed(self, s: Vector) -> bool:
        """Whether a state at such a turning lies beyond a contact that should have ended the held mode."""
        driver = self._driver(s)
        return any(self.may(b) and b.progress(*driver)[0] > b.contact + 2 * GAP for b in self.branches)

    def handle(self, name: str, t: float, s: Vector) -> Vector:
        """Switch the modes at an event; returns the state after it."""
        was = self.active
        if name == "release":
            self.stop = 0
            return s
        if name in ("low", "high"):
            s[3], self.stop = 0.0, -1 if name == "low" else 1
        elif name in ("slack", "taut"):
            s[1], s[4], self.slack = 0.0, 0.0, name == "slack"
        return self.settle(t, s, was if name in ("reverse", "complete") else None)


def _ahead(actuator: Actuator, b: Branch) -> Callable[[float, Vector], float]:
    return lambda _t, s: b.progress(*actuator._driver(s))[0] - b.contact


def _above(actuator: Actuator, level: float) -> Callable[[float, Vector], float]:
    return lambda t, s: actuator._condition(t, s) - level


def _turning(actuator: Actuator, i: int) -> Callable[[float, Vector], float]:
    return lambda t, s: actuator._paces(t, s)[i] - 2 * REST


def _gate_level(now: int, side: int) -> tuple[float, int]:
    """Level and direction of the condition's change: a rate at rest must pass twice the rest, to rest fall below it."""
    direction = 1 if side > now else -1
    return (REST if side == 0 else 2 * REST) * (side if side else now), direction
