"""What a rig is made of, by the names that an experiment file uses. SI, degrees Celsius, angles in radians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

Effects = Mapping[str, float]  # coefficient of each effect of the truth, by name
GRAVITY = 9.81


@dataclass(frozen=True, kw_only=True)
class Wire:
    """Wire, heat balance and amplifier (Elahinia 2004, tables 3.1 and 3.2)."""

    wire_length: float  # m
    wire_diameter: float  # m
    density: float = 6450.0  # kg/m^3
    specific_heat: float  # J/(kg K)
    convection_coefficient: float  # W/(m^2 K)
    ambient_temperature: float  # degC
    resistivity_austenite: float  # ohm m
    resistivity_martensite: float
    austenite_start: float = 68.0  # degC
    austenite_finish: float = 78.0
    martensite_start: float = 52.0
    martensite_finish: float = 42.0
    stress_slope_austenite: float = 10.3e6  # C_A, Pa/K
    stress_slope_martensite: float = 10.3e6  # C_M
    young_modulus_austenite: float = 75e9  # Pa
    young_modulus_martensite: float = 28e9
    recoverable_strain: float
    thermal_modulus: float = 0.55e6  # theta_T, Pa/K
    drive: str = "voltage"  # what the command is: voltage (V) or duty (share of the time that the supply is on)
    gain: float = 1.0  # volts on the wire per volt of command; of a duty the supply's volts

    @property
    def area(self) -> float:
        """Cross-section, m^2."""
        return math.pi * self.wire_diameter**2 / 4

    @property
    def mass(self) -> float:
        """kg per metre."""
        return self.density * self.area

    @property
    def surface(self) -> float:
        """Cooled surface, m^2 per metre."""
        return math.pi * self.wire_diameter

    def modulus(self, xi: float) -> float:
        """E of a martensite fraction, Pa."""
        return self.young_modulus_austenite + xi * (self.young_modulus_martensite - self.young_modulus_austenite)


@dataclass(frozen=True, kw_only=True)
class Load:
    """What the wire moves.

    inertia q'' = ratio A_w stress - damping q' - weight cos(q if turns else 0) - force - stiffness q; the wire's strain
    changes by -ratio q'/length (eq. 3.7, 3.8, 3.13, 3.14). q counts from `start`, the spring from there too.
    """

    ratio: float
    inertia: float
    damping: float
    weight: float = 0.0
    turns: bool = False
    force: float = 0.0
    stiffness: float = 0.0
    start: float = 0.0
    low: float = -math.inf
    high: float = math.inf

    def resistance(self, q: float) -> float:
        """Force, or torque, against which the wire pulls at q."""
        weight = self.weight * math.cos(q) if self.turns else self.weight
        return weight + self.force + self.stiffness * (q - self.start)

    def resistance_slope(self, q: float) -> float:
        """Derivative of `resistance`."""
        return self.stiffness - (self.weight * math.sin(q) if self.turns else 0.0)
