"""What a cycle leaves under the rate form of the constitutive law, as docs/limits.md says it, and that the law `integrated` closes."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

from smajax.control.compose import compose
from smajax.control.found_notes import notes_of_cycle
from smajax.control.run_notes import CycleLeavesStrain, Note
from smajax.core.parameters import set_parameters
from smajax.model.presets import WIRES
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.wire.form import IntegratedForm, RateForm
from smajax.model.wire.laws import LAWS, under_law
from smajax.report.note_words import note_sentences
from smajax.simulation.dataset import simulate_dataset

DT = 0.01
STEPS = np.tile(np.repeat([6.0, 0.0], 600), 2)  # two cycles of 12 s
RAMPS = np.concatenate([np.linspace(0.0, 6.0, 6000), np.linspace(6.0, 0.0, 6000), np.zeros(1000)])


def _weight(law: str = "", **values: float) -> System:
    return set_parameters(compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage", law=law), values)


def _run(volts: np.ndarray, system: System) -> xr.Dataset:
    return simulate_dataset(system, {"voltage": jnp.asarray(volts)}, DT, 1e-4)


def _left(system: System, volts: np.ndarray, cycles: int) -> tuple[float, list[Note]]:
    """(strain that a cycle leaves in %, what is noted of the run)."""
    data = _run(volts, system)
    strain = data["strain"].to_numpy()
    return 100.0 * (strain[-1] - strain[0]) / cycles, notes_of_cycle(system, data)


@pytest.mark.parametrize(
    ("volts", "cycles", "values", "percent"),
    [
        (STEPS, 2, {}, 0.20),
        (STEPS, 2, {"thermal_modulus": 0.0}, 0.25),
        (STEPS, 2, {"damping": 0.5}, 0.036),
        (RAMPS, 1, {}, -0.013),
        (RAMPS, 1, {"damping": 0.5}, -0.0315),
        (RAMPS, 1, {"damping": 0.5, "thermal_modulus": 0.0}, 0.0005),
        (STEPS, 2, {"young_modulus_austenite": 28e9}, 0.0),
    ],
)
def test_stress_that_changes_with_the_fraction_leaves_a_strain_where_the_modulus_does(volts, cycles, values, percent):
    left, notes = _left(_weight(**values), volts, cycles)
    assert left == pytest.approx(percent, abs=0.002)
    said = [left * cycles] if abs(left * cycles) > 0.05 else []
    assert [100.0 * one.strain for one in notes if isinstance(one, CycleLeavesStrain)] == pytest.approx(said, abs=1e-4)


@pytest.mark.parametrize("volts", [STEPS, RAMPS])
def test_under_the_law_integrated_every_cycle_closes(volts):
    left, notes = _left(_weight("integrated"), volts, 1)
    assert abs(left) < 1e-4
    assert notes == []


def test_the_law_integrated_is_the_enhanced_one_but_for_the_form_and_no_other_changes_the_form():
    wire = WIRES["niti_table_3_1"]()
    changed, plain = under_law(wire, "integrated"), under_law(wire, "enhanced")
    assert changed.kinetics == plain.kinetics
    assert changed.constitutive == dataclasses.replace(plain.constitutive, form=IntegratedForm())
    for name in {*LAWS} - {"integrated"}:
        assert under_law(wire, name).constitutive.form == RateForm()
        assert under_law(changed, name).constitutive.form == IntegratedForm()
    assert arm("integrated").wire.constitutive.form == IntegratedForm()
    assert arm().wire.constitutive.form == RateForm()


def test_nothing_is_noted_of_a_run_that_ends_elsewhere_or_of_a_wire_with_an_effect():
    hot = _run(STEPS[:601], _weight())
    assert notes_of_cycle(_weight(), hot) == []
    cold = _run(STEPS, _weight())
    (note,) = notes_of_cycle(_weight(), cold)
    longer, shorter = note_sentences([note, CycleLeavesStrain(-0.0012)])
    assert "0.4 % of its length longer: in rate form, the default, cycles do not close (docs/limits.md)" in longer
    assert "0.12 % of its length shorter" in shorter
    effects = compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage", effects=["latent_heat"])
    assert notes_of_cycle(effects, cold) == []
