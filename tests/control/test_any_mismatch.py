"""Sweeps and tuning over any parameter of a plant that a ratio changes, by its own name."""

from __future__ import annotations

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.mismatch import MISMATCHES, check_known, mismatches_of, of_a_ratio
from smajax.control.perturbed_plant import perturbed_plant
from smajax.control.plants import plant_set
from smajax.control.sweep.run_sweep import may_resume, sweep_controllers, sweep_settings_for
from smajax.control.sweep.spread_plants import spread_plants
from smajax.control.tune.scenarios import tuned_on
from smajax.control.tune.settings import settings_for
from smajax.core.parameters import parameter_values, parameters
from smajax.model.presets import build

PLANTS = {
    "arm": build("niti_table_3_1", "arm", "amplified_voltage"),
    "bias_spring": build("flexinol_ht_500um", "bias_spring", "voltage"),
}
ASKED = ("specific_heat", "recoverable_strain")


@pytest.mark.parametrize("load", PLANTS)
def test_what_is_asked_for_is_a_mismatch_beside_those_of_the_load(load: str) -> None:
    plant = PLANTS[load]
    own = mismatches_of(plant)
    assert mismatches_of(plant, ASKED) == own | {name: name for name in ASKED}
    assert mismatches_of(plant, ["convection_coefficient", "austenite_start"]) == own
    table, there = parameters(plant), of_a_ratio(plant)
    assert {"specific_heat", "stress_slope_austenite", "wire_diameter"} <= set(there)
    assert not [name for name in there if table[name].unit == "degC" or parameter_values(plant)[name] == 0.0]


def test_an_arm_with_another_drive_has_the_mismatches_that_are_its() -> None:
    by_duty, by_current = (build("niti_table_3_1", "arm", drive) for drive in ("duty", "current"))
    assert mismatches_of(by_duty)["supply"] == "supply_voltage"
    assert "supply" not in mismatches_of(by_current)
    for plant in (by_duty, by_current):
        assert set(mismatches_of(plant).values()) <= set(parameters(plant))
        assert plant_set(plant).columns == tuple(mismatches_of(plant))


@pytest.mark.parametrize(
    ("over", "ratios", "said"),
    [
        ("recoverable_strain", (0.5, 4.0), "^4 times recoverable_strain: "),
        ("lower_stop", (0.5, 2.0), r"^0.5 times lower_stop: the load starts at .* end stops"),
    ],
)
def test_a_ratio_at_which_the_plant_is_none_is_refused(over: str, ratios: tuple[float, float], said: str) -> None:
    settings = sweep_settings_for(PLANTS["arm"], ["pid"], first=over, second="", ratio_range=ratios)
    with pytest.raises(ValueError, match=said):
        settings.check(PLANTS["arm"])


@pytest.mark.parametrize(
    ("name", "said"), [("austenite_start", "a temperature"), ("specific_haet", "did you mean 'specific_heat'")]
)
def test_what_no_ratio_changes_is_refused_by_name(name: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        check_known([name], PLANTS["arm"])
    with pytest.raises(ValueError, match=said):
        spread_plants(PLANTS["arm"], [*MISMATCHES, name], 4)


def test_a_swept_loop_runs_on_the_plant_that_its_row_says() -> None:
    plant = PLANTS["bias_spring"]
    settings = sweep_settings_for(plant, ["pid"], first=ASKED[0], second=ASKED[1], points=3)
    found = settings.check(plant)
    rows = settings.grid_on(found).rows()
    heat, strain = (rows[:, found.columns.index(name)] for name in ASKED)
    assert {(0.5, 2.0), (2.0, 0.5), (1.0, 1.0)} <= set(zip(heat.tolist(), strain.tolist(), strict=True))
    assert np.all(np.delete(rows[:, : len(found.columns)], [found.columns.index(one) for one in ASKED], axis=1) == 1.0)
    row = rows[np.flatnonzero((heat == 2.0) & (strain == 0.5))[0]]
    values = dict(zip(found.columns, map(jnp.asarray, row), strict=False))
    true, believed = parameter_values(perturbed_plant(plant, values, found.perturbation)), parameter_values(plant)
    assert {name: true[name] / believed[name] for name in ASKED} == pytest.approx(
        dict(zip(ASKED, (2.0, 0.5), strict=True))
    )
    assert {name for name in true if true[name] != pytest.approx(believed[name])} == set(ASKED)


def test_gains_are_tuned_on_the_corners_of_what_is_asked_for() -> None:
    plant, variation = PLANTS["arm"], {"specific_heat": 0.2, "damping": 0.1}
    settings = settings_for(plant, "pid", variation=variation)
    found = settings.check(plant)
    assert found.columns == (*MISMATCHES, "specific_heat")
    rows = tuned_on([20.0], variation, 0, found).rows
    corners = rows[:, [found.columns.index(name) for name in variation]]
    assert set(map(tuple, corners.round(9).tolist())) == {(1.0, 1.0), (0.8, 0.9), (0.8, 1.1), (1.2, 0.9), (1.2, 1.1)}


def test_more_than_two_are_spread_plants() -> None:
    plant = PLANTS["bias_spring"]
    several = spread_plants(plant, [*ASKED, "convection"], 8)
    assert set(several) == {*ASKED, "convection_coefficient"}
    batch = plant_set(plant, several).batch
    assert batch is not None
    assert batch.shape == (8, 3)


def test_the_seed_of_a_sweep_is_that_of_its_noise() -> None:
    plant = PLANTS["bias_spring"]
    settings = sweep_settings_for(plant, ["pid"], points=2, set_points=(1.0,), gain_ratios=(1.0,), seconds=1.0)
    first, again, other = (
        next(iter(sweep_controllers(plant, dataclasses.replace(settings, seed=seed)))).merits.steady_error
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert (np.asarray(first) != np.asarray(other)).all()


def test_a_sweep_of_before_there_was_a_seed_goes_on() -> None:
    record = sweep_settings_for(PLANTS["arm"], ["pid"]).record()
    before = {name: value for name, value in record.items() if name != "seed"}
    assert may_resume(before, record)
    assert not may_resume(before, {**record, "seed": 1})
