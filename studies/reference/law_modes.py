"""Modes, rates and events of a wire that follows one of the named laws (`wire_law.LAWS`), however it is driven.

Inside an active branch xi is an algebraic function of y = T - stress/C with G = dxi/dy <= 0, so the rates follow from

    n stress' = E strain' + theta_T T' + Omega xi'      n = 1 + E eps_L d'(stress) xi while detwinning, otherwise 1
    c T' - L xi' = heat                                 c = 1, L = 0 where T itself is prescribed
    xi' = G (T' - stress'/C)
    xi_s' = w xi' + (n - 1)/(E eps_L) stress'           w: 1 in a single variant, d(stress) cooling, xi_s/xi heating

with Omega = B - E eps_L w. B is 0 in the rate form; the integrated form strain = (stress - theta_T (T - T_0))/E(xi) +
eps_L xi_s + constant has B = E'(xi)/E (stress - theta_T (T - T_0)). An active branch keeps the sign of y', and changes
that of stress' only where no condition depends on it; detwinning keeps the sign of stress'. So the branch is chosen
from the rates of the held wire, and detwinning anew from those with the branch. SI units, degrees Celsius.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from studies.reference.event_march import Function, Vector
from studies.reference.wire_law import LAWS, Branch, branches, detwinned_share
from studies.reference.wire_parameters import WireParameters

GAP = 1e-10  # in progress or fraction: keeps an event just handled from firing again on rounding
SLACK_BELOW = -0.1  # Pa


@dataclass(frozen=True)
class Forcing:
    """What drives the material: heat (K/s times capacity), and the rate of strain or, where not None, of stress."""

    heat: float
    strain_rate: float = 0.0
    stress_rate: float | None = None
    capacity: float = 1.0
    latent: float = 0.0


class LawModes(ABC):
    """State (T, stress, two of the drive's own, gap, xi_s) and the discrete modes. gap: prescribed less own strain."""

    def __init__(self, wire: WireParameters, rest_rate: float) -> None:
        self.wire, self.rest_rate = wire, rest_rate
        self.law = LAWS[wire.law or wire.conditions]
        self.branches = branches(wire)
        self.active: Branch | None = None
        self.xi, self.ratio = wire.initial_martensite_fraction, 1.0  # held xi; xi_s/xi, fixed while heating
        self.senses = [0, 0]  # signs of T' and stress'
        self.loaded = self.detwinning = self.slack = False  # loaded: the martensite present was formed by loading
        for branch in self.branches:
            if branch.left(self.xi) > 0:
                branch.contact = self.law.progress(branch.left(self.xi))

    @abstractmethod
    def force(self, t: float, s: Sequence[float] | Vector, xi: float) -> Forcing:
        """What drives the material in this state."""

    @abstractmethod
    def rates(self, t: float, s: Vector) -> tuple[float, ...]:
        """Rates of the state."""

    def first_detwinned(self, stress: float) -> float:
        """xi_s at the start, where the laws split martensite."""
        given = self.wire.initial_detwinned_fraction
        return detwinned_share(self.wire, stress)[0] * self.xi if given is None else given

    def modulus(self, xi: float) -> tuple[float, float]:
        """E(xi) and E'(xi)."""
        w = self.wire
        slope = 0.0 if w.stiffness == "martensite" else w.modulus_martensite - w.modulus_austenite
        return w.modulus_martensite + (xi - 1) * slope, slope

    def fraction(self, s: Sequence[float] | Vector) -> float:
        """Martensite fraction xi in the present mode."""
        b = self.active
        if b is None:
            return self.xi
        return b.left(min(max(b.offset + b.amplitude * self.law.curve(b.progress(s)), 0.0), 1.0))

    def material(self, t: float, s: Sequence[float] | Vector, hold: bool = False) -> tuple[float, ...]:
        """(T', stress', own strain', xi_s', xi'); hold: as if no branch were transforming."""
        w, b = self.wire, None if hold else self.active
        temperature, stress, theta = float(s[0]), float(s[1]), w.thermoelastic_coefficient
        xi = self.fraction(s)
        force = self.force(t, s, xi)
        modulus, stiffening = self.modulus(xi)
        share, share_slope = detwinned_share(w, stress) if self.law.split else (1.0, 0.0)
        weight = self.ratio if self.law.split and b is not None and b.sign > 0 and not self.detwinning else share
        drawn = share_slope * xi if self.detwinning else 0.0
        n = 1 + modulus * w.recoverable_strain * drawn
        omega = -modulus * w.recoverable_strain * weight
        if w.constitutive == "integrated":
            omega += stiffening / modulus * (stress - theta * (temperature - w.ambient_temperature))
        g, c = 0.0, 1.0
        if b is not None:
            g, c = b.amplitude * self.law.slope(b.progress(s)) / b.span, b.slope
        stress_rate = 0.0 if self.slack else force.stress_rate
        if stress_rate is None:
            if 1 + g * omega / (n * c) <= 0:
                raise ValueError(
                    f"no unique rate at T = {temperature:.2f} degC, stress = {stress:.3e} Pa; expected stress to fall "
                    "as martensite grows; check the modulus, the thermoelastic coefficient and the recoverable strain"
                )
            g /= 1 + g * omega / (n * c)
            a, push = 1 - theta / (n * c), modulus * force.strain_rate / (n * c)
        else:
            a, push = 1.0, stress_rate / c
        t_rate = (force.heat - force.latent * g * push) / (force.capacity - force.latent * g * a)
        xi_rate = g * (a * t_rate - push)
        if stress_rate is None:
            stress_rate = (modulus * force.strain_rate + theta * t_rate + omega * xi_rate) / n
            own = force.strain_rate
        else:
            own = (n * stress_rate - theta * t_rate - omega * xi_rate) / modulus
        return t_rate, stress_rate, own, weight * xi_rate + drawn * stress_rate, xi_rate

    def may(self, branch: Branch) -> bool:
        """Whether the law's condition lets a branch transform, apart from its own y'."""
        warming, pulling = self.senses
        if self.law.conditions == "brinson":
            by_stress = pulling < 0 and self.loaded if branch.sign > 0 else pulling > 0
            return warming == branch.sign or by_stress
        return self.law.conditions == "enhanced" or warming == branch.sign

    def _leave(self, s: Vector) -> None:
        """Freeze xi; renew the other branch's amplitude (eq. 3.26) and both contacts."""
        left = self.active
        if left is None:
            return
        self.xi, self.active = self.fraction(s), None
        other = self.branches[left.sign > 0]
        if self.wire.renewal == "printed":
            if left.sign > 0:
                other.amplitude = 1 - self.xi
            return
        share = self.law.curve(other.progress(s))
        if share <= 0:
            raise ValueError(
                f"both branches transform at T = {s[0]:.2f} degC, stress = {s[1]:.3e} Pa; "
                "expected the austenite range above the martensite one; check the four temperatures and two slopes"
            )
        other.amplitude = other.left(self.xi) / share
        for b in self.branches:
            b.contact = max(b.progress(s), 0.0) if b.left(self.xi) > 0 else math.inf

    def settle(self, t: float, s: Vector, barred: Branch | str | None = None) -> Vector:
        """Choose the modes anew after something jumped; `barred`: a branch, or "detwin", that has just ended."""
        was, printed = self.active, self.wire.renewal == "printed"
        self._leave(s)
        rates = self._detwin(t, s, barred != "detwin")
        for i, rest in enumerate(self._rest()):
            self.senses[i] = (rates[i] > 1.5 * rest) - (rates[i] < -1.5 * rest)
        for b in self.branches:
            u, left, pace = b.progress(s), b.left(self.xi), b.pace(rates[0], rates[1])
            share = self.law.curve(u)
            if printed:
                b.contact = 0.0 if left > 0 else math.inf
            elif self.may(b) and u > b.contact + GAP and share > 0 and (pace > 0 or self.wire.anchor == "condition"):
                b.amplitude, b.contact = left / share, u
            ready = self.active is None and b is not barred and left > 0 and share > 0 and pace > 0
            if ready and self.may(b) and u >= b.contact - GAP:
                self.active = b
                if printed and b is not was:
                    b.amplitude = self.xi if b.sign > 0 else b.amplitude
                    b.offset = left - b.amplitude * share
            elif not printed and abs(u - b.contact) <= GAP:
                b.contact = u + GAP
            b.beyond = b is not self.active and u >= b.contact
        rates = self._detwin(t, s, barred != "detwin")
        if self.active is self.branches[1]:
            self.loaded = rates[1] / self.wire.martensite_slope > -rates[0]
        return s

    def _detwin(self, t: float, s: Vector, may: bool) -> tuple[float, ...]:
        """Start or end detwinning by the sign of stress', which detwinning itself does not change; the rates then."""
        xi = self.fraction(s)
        least = detwinned_share(self.wire, s[1])[0] * xi
        at_least = s[5] <= least + 2 * GAP
        s[5] = min(max(s[5], least), xi)
        self.ratio = float(s[5]) / xi if xi > 0 else 0.0
        self.detwinning = False
        self.detwinning = bool(may and self.law.split and at_least and self.material(t, s)[1] > 0)
        return self.material(t, s)

    def _rest(self) -> tuple[float, float]:
        """Rates of T and of stress below which they rest."""
        return self.rest_rate, self.rest_rate * self.wire.martensite_slope

    def watch(self) -> list[tuple[str, int, Function]]:
        """(name, direction, function) of each event that can end the present mode."""
        result: list[tuple[str, int, Function]] = []
        rest, b, law = self.rest_rate, self.active, self.law
        if self.slack:
            result.append(("taut", 1, lambda t, s: s[4] - 1e-13))
        else:
            result.append(("slack", -1, lambda t, s: s[1] - SLACK_BELOW))
        if b is not None:
            result.append(("reverse", -1, partial(self._pace, b, -rest)))
            if not law.exponential:
                result.append(("complete", 1, lambda _t, s: b.progress(s) - 1))
            if b.offset < 0:
                result.append(("complete", -1, lambda _t, s: b.offset + b.amplitude * law.curve(b.progress(s))))
            if b.sign < 0 and law.conditions == "brinson":
                side = -1 if self.loaded else 1
                result.append(("memory", side, lambda t, s: self._loading(t, s) - side * rest))
        else:
            for held in filter(self.may, self.branches):
                if held.beyond:
                    result.append(("turn", 1, partial(self._pace, held, 2 * rest)))
                elif math.isfinite(held.contact):
                    result.append(("contact", 1, partial(_ahead, held)))
        if law.split and self.detwinning:
            result.append(("detwin", -1, lambda t, s: self.material(t, s)[1] + self._rest()[1]))
        elif law.split and not self.slack:
            result.append(("detwin", -1, self._spare))
        for i in {"enhanced": (), "liang": (0,), "brinson": (0, 1)}[law.conditions]:
            still, sense = self._rest()[i], self.senses[i]
            for side in (-1, 1):
                # from rest a rate must pass twice the rest rate, to rest fall below it
                level = still * (sense if sense else 2 * side)
                if side != sense:
                    result.append(("sense", side, partial(self._held_rate, i, level)))
        return result

    def _pace(self, branch: Branch, level: float, t: float, s: Vector) -> float:
        rates = self.material(t, s)
        return branch.pace(rates[0], rates[1]) - level

    def _held_rate(self, i: int, level: float, t: float, s: Vector) -> float:
        return self.material(t, s, hold=True)[i] - level

    def _loading(self, t: float, s: Vector) -> float:
        """Loading's part in -y_M' less cooling's."""
        rates = self.material(t, s)
        return rates[1] / self.wire.martensite_slope + rates[0]

    def _spare(self, _t: float, s: Vector) -> float:
        """Detwinned martensite beyond the least that the stress allows."""
        return float(s[5]) - detwinned_share(self.wire, s[1])[0] * self.fraction(s) + GAP

    def peaks(self) -> list[tuple[int, Function]]:
        """(direction, function) of each turning of y while held: a contact passed and left in one step shows there."""
        if self.active is not None:
            return []
        held = [b for b in self.branches if self.may(b) and not b.beyond]
        return [(-1, partial(self._pace, b, 2 * self.rest_rate)) for b in held]

    def passed(self, s: Vector) -> bool:
        """Whether a state lies beyond a contact that should have ended the held mode."""
        held = [b for b in self.branches if self.may(b) and not b.beyond]
        return any(b.progress(s) > b.contact + 2 * GAP for b in held)

    def handle(self, name: str, t: float, s: Vector) -> Vector:
        """Switch the modes at an event; returns the state after it."""
        if name == "memory":
            self.loaded = not self.loaded
            return s
        if name in ("slack", "taut"):
            s[1], s[4], self.slack = 0.0, 0.0, name == "slack"
        if name == "detwin" and self.detwinning:
            return self.settle(t, s, name)
        return self.settle(t, s, self.active if name in ("reverse", "complete") else None)

    def detwinned(self, s: Vector, xi: Vector) -> Vector:
        """xi_s along a trajectory of states, one a column."""
        return s[5].clip(0.0, xi) if self.law.split else xi


def _ahead(branch: Branch, _t: float, s: Vector) -> float:
    return branch.progress(s) - branch.contact
