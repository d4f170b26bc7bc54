"""Where each preset's numbers come from: printed in the source, corrected, or chosen here. Read by the documentation.

A load in a file of its own says so itself, in its class variable `origins`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Origin:
    """`kind` is printed, corrected or chosen; `note` names the table, or says why."""

    kind: str
    note: str


def _printed(note: str, *names: str) -> dict[str, Origin]:
    return {name: Origin("printed", note) for name in names}


def _corrected(name: str, note: str) -> dict[str, Origin]:
    return {name: Origin("corrected", note)}


def _chosen(name: str, note: str) -> dict[str, Origin]:
    return {name: Origin("chosen", note)}


_RANGE = ("austenite_start", "austenite_finish", "martensite_start", "martensite_finish")
_SLOPES = ("stress_slope_austenite", "stress_slope_martensite")
_MODULI = ("young_modulus_austenite", "young_modulus_martensite")
_LIMIT = "none: large enough never to be met"

ORIGINS: dict[str, dict[str, Origin]] = {
    "niti_table_3_1": {
        **_printed("Table 3.1", "wire_length", "ambient_temperature", "convection_coefficient", *_RANGE, *_SLOPES),
        **_printed("Table 3.1", *_MODULI),
        **_printed("sec. 3.2.1: 150 micron", "wire_diameter"),
        **_printed("Table 3.1; the sign is that of a wire which shrinks on heating", "thermal_modulus"),
        **_corrected("density", "m = 1.14e-4 kg of Table 3.1 is per metre; over the cross-section"),
        **_corrected("specific_heat", "0.2 kcal/(kg C) of Table 3.1 in SI"),
        **_corrected("resistivity_austenite", "45 ohm of Table 3.1 is per metre; times the cross-section"),
        **_corrected("resistivity_martensite", "45 ohm of Table 3.1 is per metre; times the cross-section"),
        **_corrected(
            "recoverable_strain", "0.04 printed ends the arm at 81 deg; 2 r (135 deg)/l_0 = 0.043 is the printed stroke"
        ),
    },
    "flexinol_table_3_2": {
        **_printed("Table 3.2", "density", "resistivity_austenite", "resistivity_martensite", *_RANGE, *_SLOPES),
        **_printed("Table 3.2", *_MODULI),
        **_printed("sec. 3.5", "wire_length", "wire_diameter", "ambient_temperature"),
        **_printed("Table 3.1: Table 3.2 has none", "thermal_modulus"),
        **_corrected("specific_heat", "0.077 cal/(g C) of Table 3.2 in SI"),
        **_corrected("recoverable_strain", "full stroke of 24.75 mm (eq. 3.22) over the length"),
        **_chosen("convection_coefficient", "not printed for this rig; Table 3.1's"),
    },
    "flexinol_ht_500um": {
        **_chosen("wire_length", "of the measured bench"),
        **_chosen("wire_diameter", "of the measured bench"),
        **_chosen("density", "Table 3.2's"),
        **_chosen("specific_heat", "Table 3.1's"),
        **_chosen("convection_coefficient", "nominal, to be fitted"),
        **_chosen("ambient_temperature", "room"),
        **_chosen("resistivity_austenite", "4.3 ohm/m of the maker's sheet"),
        **_chosen("resistivity_martensite", "4.3 ohm/m of the maker's sheet"),
        **{name: Origin("chosen", "Table 3.1's, 20 C higher (a 90 C wire), to be fitted") for name in _RANGE},
        **{name: Origin("chosen", "Table 3.1's") for name in (*_SLOPES, *_MODULI, "thermal_modulus")},
        **_chosen("recoverable_strain", "nominal, to be fitted"),
    },
    "flexinol_isobaric": {
        **{
            name: Origin("chosen", "does not enter a coupon")
            for name in (
                "wire_length",
                "wire_diameter",
                "density",
                "specific_heat",
                "convection_coefficient",
                "resistivity_austenite",
                "resistivity_martensite",
            )
        },
        **_chosen("ambient_temperature", "room; the thermal strain counts from it"),
        **{name: Origin("chosen", "Table 3.2's, to be fitted") for name in (*_RANGE, *_MODULI)},
        **{name: Origin("chosen", "nominal, to be fitted") for name in (*_SLOPES, "recoverable_strain")},
        **_chosen("thermal_modulus", "Table 3.1's"),
    },
    "arm": {
        **_printed("Table 3.1, r; it says diameter, eq. 3.7 and the stroke say radius", "pulley_radius"),
        **_printed("Table 3.1", "payload_mass", "link_mass", "spring_stiffness"),
        **_printed("Fig. 3.1: -45 deg", "start_angle"),
        **_chosen("arm_length", "makes the wire carry the printed sigma_0 = 75 MPa at -45 deg"),
        **_chosen(
            "spring_lever", "M2 and M3: 7.2 V stops inside the range, 7.3 V goes through it (studies/arm_geometry)"
        ),
        **_chosen("spring_rest_angle", "the spring is slack at -45 deg"),
        **_chosen("damping", "a swing dies out in about a second"),
        **_chosen("lower_stop", "the arm rests at -45 deg"),
        **_chosen("upper_stop", "beyond the printed +90 deg"),
        **_chosen("inertia_ratio", "that of payload and link alone"),
    },
    "dead_weight": {
        **_printed("sec. 3.5: 75 g", "load_mass"),
        **_chosen("damping", "settles a mass on this wire without ringing"),
    },
    "bias_spring": {
        **{
            name: Origin("chosen", "nominal for the measured bench, to be fitted")
            for name in ("slider_mass", "spring_stiffness", "spring_preload")
        },
        **_chosen("damping", "critical or more"),
    },
    "voltage": {**_chosen("amplifier_gain", "no amplifier"), **_chosen("amplifier_limit", _LIMIT)},
    "amplified_voltage": {
        **_chosen("amplifier_gain", "2 on V^2/R of one metre (eq. 4.28), so 2 l_0: M2 and M3"),
        **_chosen("amplifier_limit", _LIMIT),
    },
    "flexinol_voltage": {
        **_chosen("amplifier_gain", "puts the onset just above 4 V (M11)"),
        **_chosen("amplifier_limit", _LIMIT),
    },
    "duty": {**_chosen("supply_voltage", "of the measured bench")},
}

for _name in ("niti_table_3_1", "flexinol_table_3_2"):
    ORIGINS[f"{_name}_expanding"] = ORIGINS[_name] | _chosen(
        "thermal_modulus", "the printed size with the physical sign"
    )


def origins_of(name: str, part: object) -> dict[str, Origin]:
    """Parameter -> origin of a preset and what it makes: of the table above, or else what the part's class says (`origins`)."""
    said = {key: Origin(*text.split(": ", 1)) for key, text in getattr(part, "origins", {}).items()}
    return ORIGINS.get(name, said)
