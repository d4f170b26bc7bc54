"""Parameters of the reference integration: the two printed rigs as defaults, all overridable. SI, degrees Celsius."""

from __future__ import annotations

import math
from dataclasses import dataclass

CHOICES: dict[str, tuple[str | None, ...]] = {
    "conditions": ("enhanced", "liang"),
    "law": (None, "tanaka", "liang", "brinson", "enhanced"),
    "drive": ("voltage", "current", "power"),
    "constitutive": ("rate", "integrated"),
    "stiffness": ("mixed", "martensite"),
    "renewal": ("corrected", "printed"),
    "anchor": ("condition", "motion"),
}
LAW_ONLY = ("constitutive", "stiffness", "renewal", "anchor")


@dataclass(frozen=True, kw_only=True)
class WireParameters:
    """Wire, heat balance and amplifier; the values common to both rigs (Elahinia 2004, tables 3.1 and 3.2)."""

    diameter: float = 150e-6  # m
    density: float = 6450.0  # kg/m^3
    mass_per_metre: float | None = None  # kg/m; None: density pi d^2/4
    surface_per_metre: float | None = None  # m^2/m; None: pi d
    specific_heat: float = 322.0  # J/(kg K)
    resistance_martensite: float = 45.0  # ohm/m
    resistance_austenite: float = 45.0  # ohm/m
    convection_coefficient: float = 150.0  # W/(m^2 K)
    convection_slope: float = 0.0  # 1/K: fraction by which convection grows per degree above ambient
    ambient_temperature: float = 20.0  # degC
    latent_heat: float = 0.0  # J/kg
    modulus_austenite: float = 75e9  # Pa
    modulus_martensite: float = 28e9  # Pa
    thermoelastic_coefficient: float = 0.55e6  # Pa/K
    recoverable_strain: float = 0.04
    austenite_start: float = 68.0  # degC
    austenite_finish: float = 78.0
    martensite_start: float = 52.0
    martensite_finish: float = 42.0
    austenite_slope: float = 10.3e6  # C_A, Pa/K
    martensite_slope: float = 10.3e6  # C_M, Pa/K
    length: float = 0.9  # m
    gain: float = 1.0  # amplifier: I = gain V / (R length)
    initial_temperature: float | None = None  # degC; None: ambient
    initial_martensite_fraction: float = 1.0
    conditions: str = "enhanced"  # without a `law`: or "liang", whose xi jumps onto a curve passed while it was off
    law: str | None = None  # "tanaka", "liang", "brinson" or "enhanced" (wire_law.LAWS); their xi never jumps
    drive: str = "voltage"  # what the input is: or "current" (A), or "power" (W over the whole wire)
    # The rest is read only with a law, and by the path integration.
    constitutive: str = "rate"  # eq. 3.2; or "integrated": eq. 4.51 with the thermal term
    stiffness: str = "mixed"  # E(xi), eq. 3.15; or "martensite": E_M throughout
    renewal: str = "corrected"  # of xi_M and xi_A, eq. 3.26; or "printed"
    anchor: str = "condition"  # a curve passed while off is re-anchored once its condition holds; or "motion": y' too
    detwinning_start: float = 100e6  # Pa, split laws
    detwinning_finish: float = 170e6
    initial_detwinned_fraction: float | None = None  # xi_s; None: the least that the first stress allows

    def __post_init__(self) -> None:
        for name, allowed in CHOICES.items():
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} is {getattr(self, name)!r}; expected one of {allowed}; choose one of them")
        changed = [name for name in LAW_ONLY if getattr(self, name) != CHOICES[name][0]]
        if self.law is None and changed:
            raise ValueError(f"{changed} set without a law; expected a law beside them; set law='enhanced', say")

    @property
    def area(self) -> float:
        """Cross-section, m^2."""
        return math.pi * self.diameter**2 / 4

    def electric_heat(self, value: float, resistance: float) -> float:
        """Heat per metre, W/m, from the input (V, A or W, as `drive` says) and the resistance per metre."""
        if self.drive == "current":
            return value**2 * resistance
        return value / self.length if self.drive == "power" else (self.gain * value / self.length) ** 2 / resistance


@dataclass(frozen=True, kw_only=True)
class ArmParameters(WireParameters):
    """One-link arm with end stops (Elahinia 2004, table 3.1); the gain makes the power (2 V)^2/45 per metre (4.28)."""

    mass_per_metre: float | None = 1.14e-4
    surface_per_metre: float | None = 4.712e-4
    specific_heat: float = 837.0
    gain: float = 1.8
    initial_stress: float = 75e6  # Pa
    pulley_radius: float = 8.25e-3  # m
    payload_mass: float = 0.05719  # kg
    arm_mass: float = 0.0187  # kg
    arm_length: float = 0.04738  # m
    spring_stiffness: float = 3.871  # N/m
    spring_radius: float = 0.045  # m
    spring_rest_angle: float = math.radians(-45.0)
    damping: float = 3e-3  # N m s/rad
    lowest_angle: float = math.radians(-45.0)
    highest_angle: float = math.radians(95.0)
    initial_angle: float = math.radians(-45.0)


@dataclass(frozen=True, kw_only=True)
class DeadWeightParameters(WireParameters):
    """Wire lifting a weight (Elahinia 2004, table 3.2, Flexinol); starts at rest with stress m g/A_w."""

    resistance_martensite: float = 76e-8 / (math.pi * 150e-6**2 / 4)
    resistance_austenite: float = 84e-8 / (math.pi * 150e-6**2 / 4)
    ambient_temperature: float = 23.0
    recoverable_strain: float = 0.02475 / 0.537
    austenite_slope: float = 6.89e6
    martensite_slope: float = 6.89e6
    length: float = 0.537
    damping: float = 20.0  # N s/m


@dataclass(frozen=True, kw_only=True)
class BiasSpringParameters(WireParameters):
    """Slider on a bias spring; of a wire of its own, so every value that the rig has must be given."""

    slider_mass: float = 0.1  # kg
    damping: float = 20.0  # N s/m
    spring_stiffness: float = 100.0  # N/m
    spring_preload: float = 10.0  # N
