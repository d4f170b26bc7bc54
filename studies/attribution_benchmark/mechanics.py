"""Forces on the load and strains of the wire beyond those of the base equations."""

from __future__ import annotations

import math

from studies.attribution_benchmark.parameters import Effects, Load, Wire

PRESLIDING = 2e-3  # share of the stroke over which friction builds up (Dahl 1968)
STRIBECK_SPEED = 2e-2  # share of the stroke per second
STICK = 2.0  # share of the sliding friction that sticking adds (Stribeck)
COG_PERIOD = 0.07  # share of the stroke
DETENT_AT, DETENT_WIDTH = 0.5, 0.08  # shares of the stroke
CREEP_TIME = 8.0  # s
REFERENCE_STRESS = 100e6  # Pa


class Mechanics:
    """Extra forces: friction, cogging, a detent, a stiffening spring. `stroke`: that of a full transformation."""

    def __init__(self, wire: Wire, load: Load, effects: Effects) -> None:
        get = effects.get
        self.stroke = wire.recoverable_strain * wire.wire_length / load.ratio
        rest = load.resistance(load.start)
        self.shares = get("coulomb_friction", 0.0), get("stribeck_friction", 0.0)
        self.carry(load)
        self.stiffening = get("nonlinear_spring", 0.0) * rest / self.stroke**3
        self.cogging, self.detent = get("cogging", 0.0) * rest, get("detent", 0.0) * rest
        self.start = load.start
        self.rubs = bool(self.coulomb or self.stribeck)

    def carry(self, load: Load) -> None:
        """Another load from now on: friction is a share of what it pulls with at rest."""
        self.coulomb, self.stribeck = (share * load.resistance(load.start) for share in self.shares)

    def resistance(self, q: float) -> float:
        """Force, or torque, beyond the load's own that depends on the position."""
        x, extra = (q - self.start) / self.stroke, 0.0
        if self.stiffening:
            extra += self.stiffening * (q - self.start) ** 3
        if self.cogging:
            extra += self.cogging * math.sin(2 * math.pi * x / COG_PERIOD)
        if self.detent:
            d = (x - DETENT_AT) / DETENT_WIDTH
            extra += self.detent * d * math.exp(0.5 - d * d / 2)
        return extra

    def friction_rate(self, friction: float, v: float) -> float:
        """Rate of the friction force; its level falls with the speed where there is a Stribeck effect."""
        level = self.coulomb
        if self.stribeck:
            level += self.stribeck * (1 + STICK * math.exp(-((v / (STRIBECK_SPEED * self.stroke)) ** 2)))
        return level / (PRESLIDING * self.stroke) * (v - abs(v) * friction / level)


class Strains:
    """Strains in series with those of eq. 3.2: rates per degree, per fraction, per pascal and per second."""

    def __init__(self, wire: Wire, effects: Effects) -> None:
        get = effects.get
        self.base = wire.recoverable_strain
        self.expansion = get("thermal_expansion", 0.0)
        self.oriented, self.level = get("stress_dependent_strain", 0.0), REFERENCE_STRESS
        self.residual = get("residual_strain", 0.0)
        self.quadratic = get("quadratic_strain", 0.0)
        self.compliance = get("series_compliance", 0.0) / wire.young_modulus_austenite
        self.creep = get("creep", 0.0)
        self.mismatch = get("elastic_mismatch", 0.0)
        self.wire = wire

    def softened(self, old: float, xi: float, stress: float, temperature: float) -> float:
        """Strain gained as the fraction goes from `old` to `xi`, and the modulus with it: of sigma = E eps_elastic + theta_T (T - T_inf)."""
        before, after = (self.wire.modulus(one) for one in (old, xi))
        return self.mismatch * self._elastic(stress, temperature) * (1.0 / after - 1.0 / before)

    def softening(self, xi: float, stress: float, temperature: float) -> float:
        """The rate of `softened` by the fraction."""
        wire = self.wire
        softer = wire.young_modulus_austenite - wire.young_modulus_martensite
        return self.mismatch * self._elastic(stress, temperature) * softer / wire.modulus(xi) ** 2

    def _elastic(self, stress: float, temperature: float) -> float:
        """E times the elastic strain: the stress less its thermal part."""
        return stress - self.wire.thermal_modulus * (temperature - self.wire.ambient_temperature)

    def per_fraction(self, xi: float, stress: float, sign: int) -> float:
        """Strain per unit of martensite fraction; `sign` of the active branch, +1 heating."""
        strain = self.base
        if self.quadratic:
            strain *= 1 + self.quadratic * (2 * xi - 1)
        if self.oriented:
            strain += self.oriented * (1 - math.exp(-max(stress, 0.0) / self.level))
        if self.residual:
            strain -= self.residual * sign
        return strain

    def crept(self, creep: float, stress: float, xi: float, seconds: float) -> float:
        """By how much the delayed strain grows at one fraction."""
        return self.creep_rate(creep, stress, xi) * CREEP_TIME * -math.expm1(-seconds / CREEP_TIME)

    def creep_rate(self, creep: float, stress: float, xi: float) -> float:
        """Rate of the delayed strain, which martensite shows more than austenite, 1/s."""
        return (self.creep * (0.2 + 0.8 * xi) * stress / self.level - creep) / CREEP_TIME
