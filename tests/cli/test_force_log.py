"""A log with a drive and a force, of a wire between a frame and a load cell: from the draft to fit, search and prediction."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.data.experiment.draft import draft
from smajax.data.experiment.draft_model import ModelChoice
from smajax.data.experiment.first_force import first_force
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.table import MeasuredDataError
from tests.helpers.small_bench import smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

TIME = np.arange(0.0, 16.0, 0.05)
TRUTH = {"wire_length": 0.3, "convection_coefficient": 120.0, "austenite_start": 66.0}
NOISE = 0.02  # N


def log(path: Path, amperes: float, pretension: float, heading: str = "time [s],current [A],load cell [N]") -> Path:
    """Off for a second, on for eight, then at two thirds of it: the force of a wire of `TRUTH`."""
    current = np.select([TIME < 1.0, TIME < 9.0], [0.0, amperes], 0.667 * amperes)
    system = sma.set_parameters(
        sma.build("flexinol_table_3_2", "blocked_wire", "current"), {**TRUTH, "pretension": pretension}
    )
    run = sma.simulate_dataset(system, {"current": jnp.asarray(current)}, dt=0.05)
    force = run["reading"].to_numpy() + np.random.default_rng(int(1e3 * amperes)).normal(0.0, NOISE, TIME.size)
    np.savetxt(path, np.stack([TIME, current, force], 1), delimiter=",", header=heading, comments="", fmt="%.6g")
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three logs with two pretensions, and the draft of their experiment with the wire's length and two unknowns."""
    folder = tmp_path_factory.mktemp("force")
    logs = [
        log(folder / f"{name}.csv", *values)
        for name, values in {"a": (0.40, 2.0), "b": (0.44, 3.0), "c": (0.42, 2.5)}.items()
    ]
    text = draft(logs, folder / "experiment.toml").text
    text = text.replace('# wire_length = "0.537 m"', 'wire_length = "0.3 m"')
    free = [line for line in text.splitlines() if line.split(" = {")[0] in TRUTH or " = { low" not in line]
    (folder / "experiment.toml").write_text("\n".join([*free, "[effects]", 'only = ["sensor_lag"]']))
    return folder


def test_a_draft_of_a_drive_and_a_force_has_a_blocked_wire_and_the_pretension_of_each_run(folder: Path) -> None:
    experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    assert (experiment.load, experiment.output_name, experiment.output_unit) == ("blocked_wire", "force", "N")
    assert [one.parameters["pretension"] for one in experiment.runs] == pytest.approx([2.0, 3.0, 2.5], abs=0.5 * NOISE)
    assert experiment.runs[0].role == "fit"
    assert experiment.noise_sigma == pytest.approx(NOISE, rel=0.2)


def test_a_force_beside_a_position_is_taken_only_if_it_is_asked_for(tmp_path: Path) -> None:
    rows = np.stack([TIME, 5.0 * (TIME > 2.0), 3.0 + np.sin(TIME), 8.0 + np.sin(TIME)], 1)
    heading = "time [s],U [V],x [mm],force [N]"
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=heading, comments="", fmt="%.6g")

    def loads(load: str) -> tuple[str, list[str]]:
        text = draft([tmp_path / "log.csv"], tmp_path / "e.toml", choice=ModelChoice(load)).text
        found = tomllib.loads(text)
        return found["model"]["load"], [name for name, one in found["channels"].items() if one["role"] == "output"]

    assert loads("") == ("dead_weight", ["position"])
    assert loads("bias_spring") == ("bias_spring", ["position"])
    assert loads("blocked_wire") == ("blocked_wire", ["force"])
    with pytest.raises(
        MeasuredDataError,
        match=r"a reading of position and of force: dead_weight or bias_spring or (\w+ or )*blocked_wire",
    ):
        loads("arm")


def test_a_load_cell_that_counts_tension_as_negative_is_a_warning(folder: Path, tmp_path: Path) -> None:
    rows = np.loadtxt(folder / "a.csv", delimiter=",", skiprows=1)
    rows[:, 2] *= -1.0
    heading = "time [s],current [A],load cell [N]"
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=heading, comments="", fmt="%.6g")
    text = draft([tmp_path / "a.csv"], tmp_path / "e.toml").text
    assert "# pretension = " in text  # not what the force begins with
    (tmp_path / "e.toml").write_text(text)
    (said,) = [one for one in load_experiment(tmp_path / "e.toml", CATALOGUE).warnings if "reversed" in one]
    assert "the output 'force' moves against the model" in said
    (tmp_path / "e.toml").write_text(text.replace("# reversed = true", "reversed = true"))
    assert not any("reversed" in one for one in load_experiment(tmp_path / "e.toml", CATALOGUE).warnings)
    assert not any("reversed" in one for one in load_experiment(folder / "experiment.toml", CATALOGUE).warnings)


def test_logs_of_one_sensor_each_are_paired_where_one_of_them_is_a_force(tmp_path: Path) -> None:
    """A drive with a force in one file, and the position in another, are one run; as before the load cell was a load."""
    for name, heading, columns in (
        ("drive_1.csv", "time [s],U [V],force [N]", (5.0 * (TIME > 2.0), 8.0 + 0.0 * TIME)),
        ("motion_1.csv", "time [s],x [mm]", (3.0 + np.sin(TIME),)),
    ):
        rows = np.stack([TIME, *columns], 1)
        np.savetxt(tmp_path / name, rows, delimiter=",", header=heading, comments="", fmt="%.6g")
    text = draft([tmp_path / "drive_1.csv", tmp_path / "motion_1.csv"], tmp_path / "e.toml").text
    assert tomllib.loads(text)["runs"][0]["files"] == {"voltage": "drive_1.csv", "position": "motion_1.csv"}


def test_the_first_force_is_that_before_the_heat_is_on() -> None:
    force = np.concatenate([np.full(50, 2000.0), np.linspace(2000.0, 9000.0, 50)])
    force[3] = np.nan
    force[:50] += np.tile([100.0, -100.0], 25)
    command = np.concatenate([np.zeros(50), np.ones(50)])
    assert first_force(force, "mN", command) == pytest.approx(2.0, abs=0.11)
    assert first_force(force, "mN", None) == pytest.approx(2.1)
    assert first_force(force - 2100.0, "mN", command) is None  # set to zero with the wire in it
    assert first_force(force, "mm", command) is None
    assert first_force(np.full(5, np.nan), "N", None) is None


def test_identify_finds_the_wire_behind_a_force_and_predict_another_run(folder: Path) -> None:
    ended = smajax("identify", folder, "--out", folder / "fit", "--json")
    assert ended.code == 0, ended.said
    found = json.loads((folder / "fit" / "identify.json").read_text())
    estimates = found["parameters"]
    for name in ("convection_coefficient", "austenite_start"):
        off = abs(estimates[name]["value"] - TRUTH[name])
        assert off < 4.0 * estimates[name]["standard_error"], name
        assert off < 0.01 * TRUTH[name]
    words: list[str | Path] = [
        "predict",
        folder / "fit" / "model.toml",
        folder / "c.csv",
        "--set",
        "pretension=2.5 N",
        "--out",
        folder / "predicted",
    ]
    ended = smajax(*words)
    assert ended.code == 0, ended.said
    (error,) = re.findall(r"The force of 1 run is predicted with an error \(rms\) of ([\d.]+) N", ended.out)
    assert float(error) == pytest.approx(NOISE, rel=0.15)


@pytest.mark.slow
def test_close_loop_takes_the_force_as_its_output(folder: Path) -> None:
    ended = smajax("close-loop", folder, "--out", folder / "loop")
    assert ended.code == 0, ended.said
    assert "Verdict: adequate" in ended.out
    (error,) = re.findall(r"Error on the held-out runs: ([\d.]+) N", ended.out)
    assert float(error) == pytest.approx(NOISE, rel=0.15)


def test_simulate_has_the_force_as_its_reading(tmp_path: Path) -> None:
    words: list[str | Path] = [
        "flexinol_table_3_2",
        "blocked_wire",
        "current",
        "--step",
        "0.42A:3s,0A:1s",
        "--out",
        tmp_path / "run",
    ]
    ended = smajax("simulate", *words)
    assert ended.code == 0, ended.said
    assert "The force starts at 2 N" in (tmp_path / "run" / "simulate.html").read_text()
