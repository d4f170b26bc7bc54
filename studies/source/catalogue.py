"""Every figure by name: a new one is a file beside this and a line here."""

from __future__ import annotations

from . import (
    c01_pid_at_10,
    c02_pid_at_40,
    c03_pid_at_0,
    c04_three_switches,
    c05_vsc3_everywhere,
    c06_estimated_states,
    c07_range_falls,
    c08_temperature_control,
    c09_below_the_finish,
    c10_wider_band,
    c11_sliding_against_pid,
    c12_stress_sliding,
    c13_stress_follows,
    c14_backstepping_one,
    c15_backstepping_two,
    c16_gain_of_the_rate,
    c17_gain_of_the_temperature,
    c18_wrong_inertia,
    c19_wrong_damping,
    c20_wrong_convection,
    c21_wrong_ambient,
    c22_stability,
    m01_block_loop,
    m02_partial_transformation,
    m03_full_transformation,
    m04_two_voltages,
    m05_old_conditions_stall,
    m06_enhanced_conditions_reach,
    m07_complex_loading,
    m08_simple_loading,
    m09_reductions,
    m10_directions,
    m11_voltage_steps,
    m12_spread_of_trials,
    m13_mass_removed_and_put_back,
    m14_net_fraction,
    m15_mixing,
    m16_renewal,
    m17_four_laws,
    m18_split,
    m19_stress_strain,
)
from .row import Row

CHAPTERS: dict[str, tuple[Row, ...]] = {
    "chapter3": (
        m01_block_loop.ROW,
        m02_partial_transformation.ROW,
        m03_full_transformation.ROW,
        m04_two_voltages.ROW,
        m05_old_conditions_stall.ROW,
        m06_enhanced_conditions_reach.ROW,
        m07_complex_loading.ROW,
        m08_simple_loading.ROW,
        m09_reductions.ROW,
        m10_directions.ROW,
        m11_voltage_steps.ROW,
        m12_spread_of_trials.ROW,
        m13_mass_removed_and_put_back.ROW,
        m14_net_fraction.ROW,
        m15_mixing.ROW,
        m16_renewal.ROW,
        m17_four_laws.ROW,
        m18_split.ROW,
        m19_stress_strain.ROW,
    ),
    "chapter4": (
        c01_pid_at_10.ROW,
        c02_pid_at_40.ROW,
        c03_pid_at_0.ROW,
        c04_three_switches.ROW,
        c05_vsc3_everywhere.ROW,
        c06_estimated_states.ROW,
        c07_range_falls.ROW,
        c08_temperature_control.ROW,
        c09_below_the_finish.ROW,
        c10_wider_band.ROW,
        c11_sliding_against_pid.ROW,
        c12_stress_sliding.ROW,
        c13_stress_follows.ROW,
        c14_backstepping_one.ROW,
        c15_backstepping_two.ROW,
        c16_gain_of_the_rate.ROW,
        c17_gain_of_the_temperature.ROW,
        c18_wrong_inertia.ROW,
        c19_wrong_damping.ROW,
        c20_wrong_convection.ROW,
        c21_wrong_ambient.ROW,
        c22_stability.ROW,
    ),
}


def every_row() -> list[Row]:
    """All figures, in order."""
    return [row for chapter in CHAPTERS.values() for row in chapter]


def rows(name: str) -> tuple[Row, ...]:
    """The figures of a chapter, or the one figure of that name. KeyError lists the names there are."""
    if name in CHAPTERS:
        return CHAPTERS[name]
    result = tuple(row for row in every_row() if row.name.lower() == name.lower())
    if not result:
        names = [row.name for row in every_row()]
        raise KeyError(f"No figure `{name}`; there are {', '.join([*CHAPTERS, *names])}.")
    return result
