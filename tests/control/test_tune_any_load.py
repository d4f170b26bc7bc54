"""Tuning and sweeps on any load: in its unit, on its own mismatches, or on a batch of plants in their place."""

from __future__ import annotations

import csv
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

import smajax as sma
from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.figures_of_merit import merit
from smajax.control.gains_file import read_gains
from smajax.control.loop_around import loop_around
from smajax.control.mismatch import MISMATCHES, mismatches_of
from smajax.control.plants import plant_set
from smajax.control.presets import CONTROLLERS, controllers_for
from smajax.control.reference import clock, constant
from smajax.control.sweep.grid import loop_rows
from smajax.control.sweep.run_sweep import TRUE_STATE, SweepSettings, begun_sweep, sweep_controllers, sweep_settings_for
from smajax.control.tune.evaluate import TuningProblem
from smajax.control.tune.scenarios import held_out, tuned_on
from smajax.control.tune.settings import TuneSettings, regulation_weights, settings_for
from smajax.control.tune.terms import TERMS, terms_in
from smajax.control.tune.tuning import tune
from smajax.core.parameters import get_parameters, set_parameters
from smajax.model.rigs import arm
from smajax.report.next_steps import PlantWords
from smajax.report.sweep_folder import write_sweep
from smajax.report.tune_folder import finished, write_tuning
from tests.helpers.machine_code import by_machine_code
from tests.helpers.own_load import Lever, Scheduled

pytestmark = pytest.mark.usefixtures("blank_pictures")

HANGING = sma.compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SPRING = sma.compose("flexinol_ht_500um", "bias_spring", "voltage")
LITTLE: dict[str, Any] = {
    "tried": 4,
    "starts": 1,
    "rounds": 4,
    "finish": 3,
    "seconds": 4.0,
    "unseen": 2,
    "tolerance": None,
}
PLANTS = {
    "convection_coefficient": [120.0, 140.0, 160.0, 180.0, 130.0, 170.0],
    "load_mass": [0.07, 0.08, 0.075, 0.072, 0.078, 0.074],
}


@pytest.mark.slow  # on the arm in `test_tuning_folder`
def test_tuning_pid_on_a_dead_weight_lowers_its_cost(tmp_path: Path) -> None:
    """From gains that settle late; what is written is what was found, in V/m, and reads back onto the plant."""
    slow = {"proportional_gain": 250.0, "integral_gain": 300.0, "derivative_gain": 60.0, "unwinding_time": 1.0}
    settings = settings_for(HANGING, "pid", set_points=(5.0, 15.0), variation={"payload": 0.2}, start=slow, **LITTLE)
    assert settings.unit == "mm"
    found = tune(HANGING, settings)
    problem = TuningProblem(CONTROLLERS["pid"], HANGING, seconds=4.0, loops=16)
    scenarios = found.checks["tuned on"].scenarios
    points = np.stack([problem.point(slow), problem.point(found.after.values)])
    before, after = settings.goal.cost(problem.evaluate(points, scenarios).exact, scenarios)
    assert after < 0.7 * before
    assert found.costs[1] <= found.costs[0], "nor is it worse than the scaled gains of the arm"
    assert found.units["proportional_gain"] == "V/m"
    record = write_tuning(found, tmp_path, plant=PlantWords(model="report/model.toml"))
    assert record["model"] == "report/model.toml"
    assert record["settings"]["set_points_mm"] == [5.0, 15.0]
    assert record["checks"]["inside"]["before"]["overshoot"]["unit"] == "mm"
    gains = read_gains(tmp_path / "gains.json", HANGING)
    assert gains.values == found.after.values
    loop = loop_around(HANGING, "pid", tmp_path / "gains.json")
    run = sma.simulate_loop_dataset(loop, "10 mm", 4.0, dt=0.01, tolerance=None)
    assert float(run["position"][-1]) == pytest.approx(10e-3, abs=2.5e-4)
    page = (tmp_path / "tune.html").read_text(encoding="utf-8")
    assert "5 mm to 15 mm" in page
    assert "°" not in "".join(record["conclusions"])


@pytest.mark.slow  # on the arm in `test_tune`
def test_derivatives_of_every_term_agree_with_differences_on_a_bias_spring() -> None:
    """VSC3 on a length: terms in millimetres, gains in V and m/s."""
    rig = TuningProblem(CONTROLLERS["vsc3"], SPRING, seconds=6.0, loops=16)
    scenarios = tuned_on([8.0], {"spring_preload": 0.1}, 0, rig.plants)
    point, step = 0.8 * rig.before + 0.05, 1e-6
    exact = rig.evaluate_gradients(point[None], scenarios, 0.2)
    moved = np.concatenate([point + step * np.eye(len(point)), point - step * np.eye(len(point))])
    ahead, behind = np.split(rig.evaluate_gradients(moved, scenarios, 0.2).terms, 2)
    differences = np.moveaxis((ahead - behind) / (2.0 * step), 0, -1)
    scale = np.abs(differences).max(axis=(0, 2), keepdims=True) + 1e-3
    assert np.abs(differences).max() > 0.1
    np.testing.assert_allclose(exact.gradients[0] / scale, differences / scale, atol=2e-3)


def test_terms_and_weights_are_those_of_the_unit() -> None:
    assert terms_in(plant_set(arm()).unit) is TERMS
    lengths = terms_in(plant_set(HANGING).unit)
    assert (lengths["overshoot"].unit, lengths["overshoot"].factor) == ("mm", 1e3)
    assert lengths["energy"] is TERMS["energy"]
    # A hundredth of the stroke of 24.75 mm costs a second.
    assert regulation_weights(HANGING) == {"settling_time": 1.0, "overshoot": 4.03, "steady_error": 8.06}
    assert settings_for(arm(), "pid") == TuneSettings("pid")


def test_a_sweep_by_default_is_of_what_the_load_gives() -> None:
    assert sweep_settings_for(arm()) == SweepSettings(tuple(CONTROLLERS))
    spring = sweep_settings_for(SPRING)
    assert (spring.unit, spring.first, spring.second) == ("mm", "convection", "damping")
    assert spring.seconds == pytest.approx(62.0), "its wire cools 6.2 times as slowly as the arm's"
    scheduled = dataclasses.replace(HANGING, load=Scheduled())
    own = sweep_settings_for(scheduled, noise=0.01)
    assert own.controllers == tuple(controllers_for(scheduled)), "which `test_loops_on_loads` holds to what they need"
    assert {"pid", "vsc1", "vsc2", "vsc3", "nvsc"} <= set(own.controllers)
    assert (own.second, own.noise) == ("ambient", 0.01)


def test_the_mismatches_of_a_load_are_its_parameters() -> None:
    assert mismatches_of(arm()) == MISMATCHES
    assert mismatches_of(HANGING) == {
        "damping": "damping",
        "convection": "convection_coefficient",
        "ambient": "ambient_temperature",
        "payload": "load_mass",
        "supply": "amplifier_gain",
    }
    own = mismatches_of(dataclasses.replace(HANGING, load=Lever()))
    assert {"mass", "ratio", "preload", "stiffness", "stiffening", "guide", "convection"} <= set(own)
    switched = mismatches_of(dataclasses.replace(SPRING, drive=sma.DRIVES["duty"]()))
    assert (switched["supply"], switched["inertia"]) == ("supply_voltage", "slider_mass")


def test_a_batch_of_plants_takes_the_place_of_a_variation() -> None:
    """The plant as believed and three of every four are tuned on, the fourth is held out; a loop is that of its plant."""
    settings = settings_for(HANGING, "pid", PLANTS, set_points=(5.0, 15.0), **LITTLE)
    assert settings.batch == 6
    found = settings.check(HANGING, PLANTS)
    tuned, checks = tuned_on((5.0, 15.0), {}, 0, found), held_out((5.0, 15.0), {}, 8, 0, found)
    assert tuned.size == 2 * (1 + 5)
    assert int(tuned.nominal.sum()) == 2
    assert set(checks) == {"inside"}
    np.testing.assert_allclose(checks["inside"].rows, [[180.0, 0.072, 0.010]])
    problem = TuningProblem(CONTROLLERS["pid"], HANGING, seconds=4.0, loops=16, plants=found)
    seen = problem.evaluate(problem.before[None], tuned, dt=0.01)
    row = int(np.flatnonzero(tuned.rows[:, 0] == 130.0)[1])
    plant = set_parameters(HANGING, {"convection_coefficient": 130.0, "load_mass": 0.078})
    controller = set_parameters(problem.controller, problem.gains(problem.before))
    wanted = constant(clock(4.0, 0.01), tuned.targets[row])
    loop = by_machine_code(simulate_closed_loop)(plant, controller, wanted, 0.01)
    assert float(seen.merits.energy[0, row]) == pytest.approx(float(merit(loop, plant).energy), rel=1e-5)


@pytest.mark.slow  # of a variation in `test_tuning_folder`
def test_tuning_on_a_batch_is_recorded_and_resumed_as_such(tmp_path: Path) -> None:
    little = {**LITTLE, "rounds": 1, "finish": 0}
    settings = settings_for(HANGING, "vsc2", PLANTS, set_points=(5.0, 15.0), **little)
    from smajax.control.tune.tuning_folder import tune_in_folder

    found = tune_in_folder(HANGING, settings, tmp_path, plants=PLANTS)
    record = write_tuning(found, tmp_path)
    assert record["settings"]["plants_of_the_batch"] == 6
    assert "every fourth plant of the batch" in record["checks"]["inside"]["what"]
    assert finished(HANGING, settings, tmp_path, PLANTS) is not None
    other = {**PLANTS, "load_mass": [0.07] * 6}
    with pytest.raises(ValueError, match="on another plant"):
        finished(HANGING, settings, tmp_path, other)
    with (tmp_path / "loops.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["convection_coefficient"] for row in rows if row["check"] == "inside"} == {"180"}
    assert {row["set point [mm]"] for row in rows} == {"5", "15", "10"}


def test_batches_of_systems_and_stacked_systems_are_the_same_plants() -> None:
    several = [
        set_parameters(HANGING, {name: values[k] for name, values in PLANTS.items()})
        for k in range(len(PLANTS["load_mass"]))
    ]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *several)
    by_name = plant_set(HANGING, PLANTS)
    for plants in (several, stacked):
        found = plant_set(HANGING, plants)
        assert set(found.columns) == set(PLANTS)
        order = [found.columns.index(name) for name in by_name.columns]
        assert found.batch is not None
        assert by_name.batch is not None
        np.testing.assert_allclose(found.batch[:, order], by_name.batch)
    alike = plant_set(HANGING, [HANGING, HANGING]).batch
    assert alike is not None
    assert alike.shape == (2, 1)


@pytest.mark.slow
def test_plants_may_have_effects_that_the_assumed_model_lacks() -> None:
    """Draws over several models carry the effects of all: the assumed one has them at base value, where they change nothing."""
    plants = {"latent_heat.enthalpy": [0.0, 8e3, 15e3, 20e3], "load_mass": [0.075, 0.07, 0.08, 0.075]}
    found = plant_set(HANGING, plants)
    np.testing.assert_allclose(found.nominal, [0.0, 0.075])
    wider = sma.extended(HANGING, ["latent_heat"])
    stacked = set_parameters(wider, {name: jnp.asarray(values) for name, values in plants.items()})
    assert set(plant_set(HANGING, stacked).columns) == set(plants)
    settings = SweepSettings(
        ("pid",), set_points=(8.0,), gain_ratios=(1.0,), seconds=4.0, tolerance=None, unit="mm", **TRUE_STATE
    )
    (swept,) = sweep_controllers(HANGING, settings, plants=stacked)
    (alone,) = sweep_controllers(HANGING, settings, plants={"load_mass": [0.075]})
    np.testing.assert_allclose(swept.nominal.energy, alone.nominal.energy, rtol=1e-9)
    np.testing.assert_allclose(swept.merits.energy[0, 0, 0], alone.nominal.energy, rtol=1e-9)
    assert abs(float(swept.merits.energy[3, 0, 0, 0] / alone.nominal.energy[0]) - 1.0) > 0.01


@pytest.mark.parametrize(
    ("plants", "told"),
    [
        ({"convection": [1.0]}, "no parameter 'convection'; did you mean 'convection_coefficient'"),
        ({"load_mass": [0.1, 0.2], "damping": [1.0]}, "one value a plant of each parameter"),
        ({"load_mass": [-1.0]}, "`load_mass` = -1 kg"),
        ({}, "one value a plant of each parameter"),
        ([], "has at least one"),
        ([SPRING], "plant 0 of the batch has other parts"),
    ],
)
def test_wrong_batches_are_errors(plants: Any, told: str) -> None:
    with pytest.raises(ValueError, match=re.escape(told)):
        plant_set(HANGING, plants)


def test_wrong_settings_of_a_load_are_errors() -> None:
    good = settings_for(HANGING, "pid", set_points=(5.0,), **LITTLE)
    for change, told in (
        ({"unit": "deg"}, "give them in mm and unit='mm'"),
        (
            {"set_points": (60.0,)},
            "set points are from -4.95 to 29.7 mm: the stroke of the wire under this load, and a fifth of it more at each end; not 60.",
        ),
        ({"set_points": ()}, "at least one set point; set points are from -4.95 to 29.7 mm: the stroke"),
        ({"variation": {"inertia": 0.2}}, "no variation `inertia`"),
        ({"batch": 3}, "use `settings_for`"),
    ):
        with pytest.raises(ValueError, match=re.escape(told)):
            dataclasses.replace(good, **change).check(HANGING)
    with pytest.raises(ValueError, match="takes the place of a variation"):
        dataclasses.replace(good, variation={"payload": 0.2}, batch=6).check(HANGING, PLANTS)


SWEEP = SweepSettings(
    ("pid", "sld"),
    "convection",
    "spring_preload",
    2,
    (5.0, 10.0),
    (1.0,),
    30.0,
    tolerance=None,
    unit="mm",
    **TRUE_STATE,
)


@pytest.mark.slow  # that of a batch, below, is in millimetres too
def test_a_sweep_of_a_bias_spring_is_in_millimetres(tmp_path: Path) -> None:
    """Its loops are single ones; tables, data set and page are in the load's unit."""
    write_sweep(begun_sweep(SPRING, SWEEP), sweep_controllers(SPRING, SWEEP, tmp_path), tmp_path)
    with (tmp_path / "pid.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    row = rows[-1]
    assert (row["convection_ratio"], row["spring_preload_ratio"], row["set_point_mm"]) == ("2", "2", "10")
    believed = np.asarray(get_parameters(SPRING, ["convection_coefficient", "spring_preload"]))
    plant = set_parameters(SPRING, dict(zip(("convection_coefficient", "spring_preload"), 2.0 * believed, strict=True)))
    loop = by_machine_code(simulate_closed_loop)(
        plant, CONTROLLERS["pid"].make(SPRING), constant(clock(30.0, 0.01), 0.010), 0.01
    )
    assert float(row["energy_J"]) == pytest.approx(float(merit(loop, plant).energy), rel=1e-5)
    assert float(row["steady_error_mm"]) == pytest.approx(1e3 * float(merit(loop, plant).steady_error), rel=1e-5)
    with xr.open_dataset(tmp_path / "sweep.nc", engine="scipy") as found:
        assert (found["overshoot"].attrs["units"], found["set_point"].attrs["units"]) == ("m", "m")
        assert found["energy"].dims == (
            "controller",
            "convection_ratio",
            "spring_preload_ratio",
            "set_point",
            "gain_ratio",
        )
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "2 set points from 5 mm to 10 mm" in page
    assert "within a hundredth of the stroke" in page
    assert "overshoot (mm)" in page
    assert "position, rate, stress" in page
    assert json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))["set_points_m"] == [0.005, 0.01]


def test_a_sweep_over_a_batch_has_a_row_a_plant(tmp_path: Path) -> None:
    settings = SweepSettings(
        ("vsc2",), set_points=(5.0, 15.0), gain_ratios=(1.0,), seconds=4.0, tolerance=None, unit="mm", **TRUE_STATE
    )
    begun = begun_sweep(HANGING, settings, PLANTS)
    write_sweep(begun, sweep_controllers(HANGING, settings, tmp_path, plants=PLANTS), tmp_path)
    with (tmp_path / "vsc2.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["plant"], row["set_point_mm"]) for row in rows[:3]] == [("1", "5"), ("1", "15"), ("2", "5")]
    assert len(rows) == 12
    plant = set_parameters(HANGING, {"convection_coefficient": 140.0, "load_mass": 0.08})
    loop = by_machine_code(simulate_closed_loop)(
        plant, CONTROLLERS["vsc2"].make(HANGING), constant(clock(4.0, 0.01), 0.005), 0.01
    )
    assert float(rows[2]["energy_J"]) == pytest.approx(float(merit(loop, plant).energy), rel=1e-5)
    record = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert record["sweep"]["plants"]["load_mass"] == PLANTS["load_mass"]
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "On all 6 plants of the batch it settles" in page
    assert "<h2>Batch of 6 plants</h2>" in page
    assert not (tmp_path / "vsc2_lines.png").exists()


def test_a_controller_that_cannot_lead_the_load_is_refused_by_both() -> None:
    current = dataclasses.replace(HANGING, drive=sma.DRIVES["none"]())
    with pytest.raises(ValueError, match="controller `pid` cannot lead the load DeadWeight"):
        dataclasses.replace(SWEEP, controllers=("pid",)).check(current)
    with pytest.raises(ValueError, match="no mismatch `spring_preload`"):
        SWEEP.check(HANGING)
    with pytest.raises(ValueError, match="no mismatch `wind`"):
        loop_rows({"wind": 1.2}, 0.0, plants=plant_set(HANGING))
