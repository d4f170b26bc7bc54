"""Every figure by name: a new one is a file beside this and a line here."""

from __future__ import annotations

from smajax.figures import (
    c06_estimated_states,
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
from smajax.figures.row import Row

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
    "chapter4": (c06_estimated_states.ROW,),
}


def rows(name: str) -> tuple[Row, ...]:
    """The figures of a chapter, or the one figure of that name. KeyError lists the names there are."""
    if name in CHAPTERS:
        return CHAPTERS[name]
    found = tuple(row for chapter in CHAPTERS.values() for row in chapter if row.name.lower() == name.lower())
    if not found:
        names = [row.name for chapter in CHAPTERS.values() for row in chapter]
        raise KeyError(f"No figure `{name}`; there are {', '.join([*CHAPTERS, *names])}.")
    return found
