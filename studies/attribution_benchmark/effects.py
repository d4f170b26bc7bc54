"""Effects that a truth may hold: where each applies, where the search for its strength starts, and how large it may be.

The coefficients' meanings are in the files that use them. An effect may be one of the catalogue of a package that is
scored (`outside` False) or foreign to any (`outside` True): the right answer to the latter is "none that I know".
"""

from __future__ import annotations

from dataclasses import dataclass

LOADED = ("arm", "dead_weight", "bias_spring")
EVERYWHERE = (*LOADED, "coupon")


@dataclass(frozen=True)
class Effect:
    """One effect. `first`: coefficient tried first; `largest`: the most that is physical; both may be negative."""

    group: str
    first: float
    largest: float
    unit: str
    rigs: tuple[str, ...] = LOADED
    outside: bool = False


EFFECTS: dict[str, Effect] = {
    # heat
    "latent_heat": Effect("heat", 3e3, 4e4, "J/kg"),
    "rising_convection": Effect("heat", 1e-3, 3e-2, "1/K of the convection above ambient"),
    "free_convection": Effect("heat", 0.02, 0.5, "exponent of the temperature above ambient, over 50 K"),
    "radiation": Effect("heat", 0.1, 1.0, "emissivity"),
    "ambient_drift": Effect("heat", 0.01, 0.3, "K/s"),
    "draught": Effect("heat", 0.01, 1.0, "share added to the convection between 0.35 and 0.6 of a run"),
    "end_conduction": Effect("heat", 1e-3, 5e-2, "W/K"),
    "phase_specific_heat": Effect("heat", 0.05, 1.0, "austenite's over martensite's, less one"),
    # electrical
    "phase_resistance": Effect("electrical", -0.01, -0.4, "austenite's over its nominal, less one"),
    "temperature_resistance": Effect("electrical", 2e-4, 4e-3, "1/K"),
    "lead_resistance": Effect("electrical", 0.02, 0.5, "of the cold wire's"),
    "supply_sag": Effect("electrical", 0.01, 0.3, "of the cold wire's resistance, behind 4 s"),
    "drive_dead_zone": Effect("electrical", 0.005, 0.3, "of the largest command of all runs"),
    "pwm": Effect("electrical", 0.01, 1.0, "share of the power that goes as the mean, not as the square"),
    # kinetics
    "stress_rate_share": Effect("kinetics", 1.0, 1.0, "taken off the stress rate's share 1 in eq. 3.17, 3.18"),
    "different_slopes": Effect("kinetics", 0.05, 0.5, "C_A times 1 + c, C_M times 1 - c"),
    "smooth_transformation": Effect("kinetics", 0.02, 0.8, "share of the wire over three times the range"),
    "asymmetric_transformation": Effect("kinetics", 0.05, 0.9, "a of h + a h (1 - h); -a on cooling"),
    "two_part_transformation": Effect("kinetics", 0.02, 0.4, "share that goes first on cooling, last on heating"),
    "stress_dependent_width": Effect("kinetics", 0.05, 1.0, "of the width per stress of the lightest load at rest"),
    "minor_loops": Effect("kinetics", 0.5, 10.0, "K by which the way back starts earlier after half a transformation"),
    "rate_dependence": Effect("kinetics", 0.02, 2.0, "s by which the transformation is late"),
    "transformation_drift": Effect("kinetics", 0.1, 4.0, "K down per transformation passed"),
    # constitutive
    "thermal_expansion": Effect("constitutive", 3e-6, 1e-4, "1/K, beyond theta_T"),
    "stress_dependent_strain": Effect("constitutive", 2e-3, 6e-2, "largest strain added, 100 MPa"),
    "residual_strain": Effect("constitutive", 2e-4, 1e-2, "strain left per transformation passed"),
    "creep": Effect("constitutive", 5e-4, 2e-2, "strain of martensite under 100 MPa, behind 8 s"),
    "elastic_mismatch": Effect(
        "constitutive", 0.1, 1.2, "of the change of sigma/E with the phase", ("arm", "bias_spring", "coupon")
    ),
    # mechanics
    "coulomb_friction": Effect("mechanics", 0.02, 0.5, "of the load at rest"),
    "stribeck_friction": Effect(
        "mechanics", 0.01, 0.3, "sliding, of the load at rest; three times that when it sticks"
    ),
    "series_compliance": Effect("mechanics", 0.3, 10.0, "of the austenite wire's"),
    "slack": Effect("mechanics", 5e-4, 1e-2, "strain that the wire hangs loose by", ("arm",)),
    "nonlinear_spring": Effect("mechanics", 0.02, 2.0, "of the load at rest, at full stroke", ("arm", "bias_spring")),
    "wrong_load": Effect("mechanics", 0.05, 0.6, "of the load"),
    # sensor
    "sensor_offset": Effect("sensor", 0.01, 0.5, "of the stroke", EVERYWHERE),
    "sensor_gain": Effect("sensor", 0.01, 0.5, "less one", EVERYWHERE),
    "sensor_lag": Effect("sensor", 0.02, 5.0, "s", LOADED),
    "quantisation": Effect("sensor", 0.01, 0.15, "of the stroke", EVERYWHERE),
    "dead_band": Effect("sensor", 0.005, 0.15, "play, of the stroke", EVERYWHERE),
    "sensor_drift": Effect("sensor", 0.005, 0.2, "of the stroke over a run", EVERYWHERE),
    "sensor_limit": Effect("sensor", 0.05, 0.6, "of the stroke, at its far end, that is not read", EVERYWHERE),
    # command
    "input_gain": Effect("command", 0.02, 0.3, "less one"),
    "input_delay": Effect("command", 0.02, 2.0, "s"),
    # foreign to any library when it was written; since then the library has the clamp's heat balance (`warmed_surroundings`) and a saturation of another form
    "convection_regime": Effect("heat", 0.05, 1.0, "share added to the convection's slope above 45 K", outside=True),
    "clamp_node": Effect("heat", 0.02, 1.0, "coupling to a clamp of 12 s, of the convection"),
    "drive_saturation": Effect("electrical", 0.2, 2.0, "c of v/sqrt(1 + (c v/v_max)^2)"),
    "resistance_peak": Effect("electrical", 0.02, 0.6, "of the resistance at 60 C, 8 K wide: an R-phase", outside=True),
    "bumped_transformation": Effect("kinetics", 0.3, 3.0, "c of c sin^2(pi z) sin(4 pi z)/(4 pi)", outside=True),
    "quadratic_strain": Effect("constitutive", 0.02, 0.9, "eps_L [1 + c (2 xi - 1)] per fraction", outside=True),
    "cogging": Effect("mechanics", 0.05, 1.0, "of the load at rest, period 7 % of the stroke", outside=True),
    "detent": Effect("mechanics", 0.05, 1.0, "of the load at rest, at half stroke", outside=True),
    "eccentric_encoder": Effect("sensor", 0.005, 0.06, "of the stroke", EVERYWHERE, outside=True),
    "sensor_saturation": Effect("sensor", 0.02, 0.9, "of the stroke per half stroke squared", EVERYWHERE, outside=True),
}
_COUPON = (
    "different_slopes",
    "smooth_transformation",
    "asymmetric_transformation",
    "two_part_transformation",
    "stress_dependent_width",
    "minor_loops",
    "rate_dependence",
    "transformation_drift",
    "thermal_expansion",
    "stress_dependent_strain",
    "residual_strain",
    "creep",
    "wrong_load",
    "input_delay",
    "bumped_transformation",
    "quadratic_strain",
)
# A bias spring and a single mass say nothing of how widths, slopes and strains go with stress; only the arm's stress
# changes fast enough beside its temperature to identify shares of the stress rate.
_NOT_HERE = {("stress_rate_share", "dead_weight"), ("stress_rate_share", "bias_spring"), ("pwm", "bias_spring")}
# Other values of the unknowns, or of a run's zero, give exactly the same readings: a gain of the voltage is one of h_c
# and c_p (eq. 3.1), a loss to the ends one of h_c, a lead one of both where the resistance is constant.
_ABSORBED = {
    "sensor_offset": EVERYWHERE,
    "input_gain": LOADED,
    "end_conduction": LOADED,
    "lead_resistance": ("arm", "bias_spring"),
    "different_slopes": ("coupon",),  # whose C_A and C_M are unknowns
    "wrong_load": ("coupon",),
}


def applies(name: str, rig: str) -> bool:
    """Whether the effect exists on the rig."""
    if rig == "coupon" and name in _COUPON:
        return True
    return rig in EFFECTS[name].rigs and (name, rig) not in _NOT_HERE


def absorbed(name: str, rig: str) -> bool:
    """Whether a refit of the base model takes the effect up whole: the right answer is that nothing is missing."""
    return rig in _ABSORBED.get(name, ())
