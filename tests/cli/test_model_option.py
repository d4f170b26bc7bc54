"""`--model`: simulate, tune and sweep take a kept model in the place of presets."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import smajax as sma
from smajax.cli.plant_options import LoopPlants
from smajax.control.model_as_plant import plant_of
from smajax.control.tune.scenarios import held_out, tuned_on
from smajax.control.tune.settings import settings_for
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import ModelParameter
from smajax.report.loop_words import source_sentence
from smajax.report.tune_words import held_out_sentence, plants_sentence
from tests.fit.test_predict import NOISE, kept_model, log, reading
from tests.helpers.small_bench import refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")


@pytest.fixture
def model(tmp_path: Path) -> Path:
    return kept_model().save(tmp_path / "model.toml")


def test_a_run_of_a_kept_model_is_held_against_a_log(tmp_path: Path, model: Path) -> None:
    kept = kept_model()
    run = log(tmp_path / "run.csv", reading(kept) + 2e-3, heading="t,U,x")
    words = ["--input", f"voltage={run}:U:V", "--measured", f"position={run}:x:mm", "--dt", "100ms"]
    ended = smajax("simulate", "--model", model, *words, "--out", tmp_path / "out")
    assert ended.code == 0, ended.said
    assert "The measured position is off by 2 mm (rms), by 0.09" in ended.out
    record = json.loads((tmp_path / "out" / "simulate.json").read_text(encoding="utf-8"))
    measured, simulated = (np.asarray(record["series"][name], dtype=float) for name in ("measured_position", "reading"))
    error = measured - simulated
    assert ended.out.count("off by 2 mm") == 1
    # The last input of a log holds no longer than the log.
    assert np.nanmean(error[:-1]) == pytest.approx(2e-3, abs=0.2 * NOISE)


def test_what_cannot_be_held_against_a_log_is_refused(tmp_path: Path, model: Path) -> None:
    run = log(tmp_path / "run.csv", reading(kept_model()), heading="t,U,x")
    step: list[str | Path] = ["simulate", "--model", model, "--step", "5V:5s", "--out", tmp_path / "out"]
    assert "no sensor 'angle'" in refused(*step, "--measured", f"angle={run}:x:mm")
    assert "expected a column of a log" in refused(*step, "--measured", "position=3mm")
    assert "leave these out" in refused(*step, "--law", "brinson")
    assert not (tmp_path / "out").exists()


def test_a_closed_loop_stays_within_the_commands_of_the_fit_runs() -> None:
    kept = kept_model()
    system, limit = plant_of(kept)
    # The drive's amplifier multiplies the command by 1.6.
    assert float(system.drive.largest_command()) == pytest.approx(5.0)
    assert float(sma.get_parameters(system, ["amplifier_limit"])[0]) == pytest.approx(8.0)
    assert limit is not None
    assert (limit.command, limit.unit) == ("voltage", "V")
    assert limit.largest == pytest.approx(5.0)
    assert "limited to 5 V, the largest of the runs that the model was fitted to" in source_sentence(limit)
    assert float(plant_of(kept, {"amplifier_gain": 3.2})[0].drive.largest_command()) == pytest.approx(5.0)
    assert float(plant_of(kept, limit=4.0)[0].drive.largest_command()) == pytest.approx(4.0)
    given_by_set, limit = plant_of(kept, {"amplifier_limit": "9 V"}, limit=4.0)
    assert float(sma.get_parameters(given_by_set, ["amplifier_limit"])[0]) == pytest.approx(9.0)
    assert limit is None
    given = dataclasses.replace(kept.parameters["amplifier_limit"], value=20.0, origin="given")
    own = dataclasses.replace(kept, parameters={**kept.parameters, "amplifier_limit": given})
    assert plant_of(own)[1] is None


@pytest.mark.slow
def test_gains_are_tuned_and_compared_on_plants_from_the_posterior(tmp_path: Path, model: Path) -> None:
    effort = ["--set-point", "5mm,10mm", "--fast", "--rounds", "1", "--finish", "0", "--seconds", "8", "--starts", "1"]
    ended = smajax("tune", "pid", "--model", model, "--plants", "4", *effort, "--out", tmp_path / "tuned")
    assert ended.code == 0, ended.said
    assert (
        json.loads((tmp_path / "tuned" / "tune.json").read_text(encoding="utf-8"))["settings"]["plants_of_the_batch"]
        == 4
    )
    gains = tmp_path / "tuned" / "gains.json"
    written = json.loads(gains.read_text(encoding="utf-8"))
    assert written["loop"]["command_limit"] == {"value": pytest.approx(5.0), "unit": "V"}
    assert written["loop"]["period"] == {"value": 0.01, "unit": "s"}
    assert written["loop"]["noise"] == {"value": pytest.approx(NOISE), "unit": "m"}  # of the model file
    assert written["fixed"]["rate_filter"]["unit"] == "s"
    assert written["fixed"]["largest_voltage"]["value"] <= 5.0 * (1.0 + 1e-12)
    record = json.loads((tmp_path / "tuned" / "tune.json").read_text(encoding="utf-8"))
    assert record["loop"] == written["loop"]
    assert record["fixed"] == written["fixed"]
    page = (tmp_path / "tuned" / "tune.html").read_text(encoding="utf-8")
    assert "the limit of the controller; that of the drive is 5 V" in page
    assert "0.1 mm of noise" in page
    ended = smajax("simulate", "--model", model, "--gains", gains, "--set-point", "5mm:4s", "--out", tmp_path / "loop")
    assert ended.code == 0, ended.said
    words: list[str | Path] = [
        "--plants",
        "3",
        "--set-point",
        "5mm",
        "--gain-ratios",
        "1",
        "--seconds",
        "4",
        "--out",
        tmp_path / "swept",
    ]
    ended = smajax("sweep", "--model", model, "--gains", gains, *words)
    assert ended.code == 0, ended.said
    record = json.loads((tmp_path / "swept" / "sweep.json").read_text(encoding="utf-8"))
    assert "pid" in json.dumps(record)


def test_plants_need_a_model_of_which_something_was_fitted(tmp_path: Path, model: Path) -> None:
    known = dataclasses.replace(kept_model(), likely=()).save(tmp_path / "known.toml")
    tune: list[str | Path] = ["tune", "pid", "--set-point", "5mm", "--out", tmp_path / "out"]
    assert "give --model" in refused(*tune, "--plants", "4")
    assert "has no covariance of fitted values" in refused(*tune, "--plants", "4", "--model", known)
    assert "give one of the two" in refused(*tune, "--plants", "4", "--model", model, "--variation", "damping=20%")
    assert "leave --wire, --load, --drive" in refused(*tune, "--model", model, "--load", "arm")
    assert not (tmp_path / "out").exists()


def test_an_input_that_the_models_logs_had_and_a_run_has_not_is_said(tmp_path: Path) -> None:
    kept = dataclasses.replace(kept_model(), fitted_range={"voltage": (0.0, 5.0), "mass": (0.5, 1.0)})
    path = kept.save(tmp_path / "model.toml")
    step: list[str | Path] = ["simulate", "--model", path, "--step", "4V:2s", "--dt", "100ms", "--tolerance", "none"]
    said = smajax(*step, "--out", tmp_path / "without").said
    assert "fitted to runs with their own mass, 0.5 to 1 kg; here it is load_mass, 0.075. Give --input mass=..." in said
    assert "their own mass" not in smajax(*step, "--input", "mass=0.6kg", "--out", tmp_path / "with").said
    assert "their own mass" not in smajax(*step, "--set", "load_mass=0.6 kg", "--out", tmp_path / "set").said


def hotter_model() -> ActuatorModel:
    """`kept_model` with a stronger convection and with radiation, which the kept model lacks."""
    kept = kept_model()
    radiating = ModelParameter(0.8, "given", 0.0, 1.0)
    cooled = dataclasses.replace(kept.parameters["convection_coefficient"], value=120.0, origin="given")
    parameters = {**kept.parameters, "convection_coefficient": cooled, "radiation.emissivity": radiating}
    return dataclasses.replace(kept, effects=("radiation",), parameters=parameters, likely=(), title="hotter")


@pytest.mark.slow  # those of `simulate` are in `test_loop_settings`
def test_loops_of_a_sweep_run_on_the_plant_of_another_file(tmp_path: Path, model: Path) -> None:
    plant = hotter_model().save(tmp_path / "plant.toml")
    loop: list[str | Path] = ["--model", model, "--plant", plant, "--noise", "0", "--seconds", "8"]
    words = ["--controllers", "pid", "--set-point", "5mm", "--gain-ratios", "1", "--tolerance", "none"]
    ended = smajax("sweep", *loop, *words, "--estimator", "", "--out", tmp_path / "swept")
    assert ended.code == 0, ended.said
    record = json.loads((tmp_path / "swept" / "sweep.json").read_text(encoding="utf-8"))
    assert record["sweep"]["plants"] == {"convection_coefficient": [120.0], "radiation.emissivity": [0.8]}
    with xr.open_dataset(tmp_path / "swept" / "sweep.nc") as data:
        energy = float(np.ravel(data["energy"])[0])
    one = ["--controller", "pid", "--set-point", "5mm:8s", "--dt", "10ms", "--tolerance", "none", "--json"]
    ended = smajax("simulate", *loop[:-2], *one, "--out", tmp_path / "one")
    assert ended.code == 0, ended.said
    assert energy == pytest.approx(json.loads(ended.out)["merit"]["energy"]["value"], rel=1e-6)


def test_gains_are_tuned_on_the_plant_of_another_file_too_and_checked_on_it(tmp_path: Path, model: Path) -> None:
    options = LoopPlants(model=model, plant=hotter_model().save(tmp_path / "plant.toml"))
    plants = options.plants(0, others=False)
    settings = settings_for(options.system(said=False), "pid", plants, set_points=(5.0, 10.0))
    found = settings.check(options.system(said=False), plants)
    assert plants_sentence(settings) == "the plant as believed and another one; set points 5 mm, 10 mm"
    assert held_out_sentence(settings) == "set points between those tuned, the other plant"
    seen = tuned_on(settings.set_points, {}, 0, found)
    convection = found.columns.index("convection_coefficient")
    assert sorted(zip(seen.rows[:, convection], seen.targets, strict=True)) == [
        (90.0, 0.005),
        (90.0, 0.01),
        (120.0, 0.005),
        (120.0, 0.01),
    ]
    unseen = held_out(settings.set_points, {}, 4, 0, found)["inside"]
    assert list(zip(unseen.rows[:, convection], unseen.targets, strict=True)) == [(120.0, 0.0075)]


def test_one_other_plant_is_in_the_place_of_drawn_ones_and_of_mismatches(tmp_path: Path, model: Path) -> None:
    plant = hotter_model().save(tmp_path / "plant.toml")
    tune: list[str | Path] = ["tune", "pid", "--set-point", "5mm", "--out", tmp_path / "out", "--model", model]
    assert "is one plant in the place of" in refused(*tune, "--plant", plant, "--plants", "4")
    assert "is one plant in the place of" in refused(*tune, "--plant", plant, "--variation", "damping=20%")
    arm = model_of_presets("niti_table_3_1", "arm", "amplified_voltage").save(tmp_path / "arm.toml")
    assert "the plant has the load Arm" in refused(*tune, "--plant", arm)
    law = model_of_presets("flexinol_table_3_2", "dead_weight", "flexinol_voltage", "tanaka")
    said = refused(*tune, "--plant", law.save(tmp_path / "law.toml"))
    assert "has another kinetics law than that of the controller's model" in said
    assert not (tmp_path / "out").exists()
