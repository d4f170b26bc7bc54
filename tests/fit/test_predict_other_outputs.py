"""A log that lacks the load's own sensor is predicted all the same, and compared on the outputs that it has."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.data.experiment.errors import ExperimentError
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.record import ModelOutput
from smajax.report.predict_words import conclusions, run_rows
from tests.fit.test_predict import NOISE, TIME, VOLTS, kept_model
from tests.helpers.small_bench import bench, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

OHMS = 1e-3  # ohm: noise of the resistance
RESISTANCE = (
    '[channels.resistance]\nrole = "output"\ncolumn = "R"\nunit = "ohm"\nnoise = "1 mohm"\n[[runs]]\nname = "A"'
)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> ActuatorModel:
    """Fitted to position and resistance, whose columns its file names."""
    file = bench(
        tmp_path_factory.mktemp("bench"),
        ('drive = "voltage"', 'drive = "flexinol_voltage"'),
        ('[[runs]]\nname = "A"', RESISTANCE),
    )
    for name in ("a.csv", "b.csv"):
        written(file.parent / name, kept_model(), "t", "U", "x", "R")
    known = sma.load_experiment(file).log_format
    outputs = (ModelOutput("position", "m", NOISE, False), ModelOutput("resistance", "ohm", OHMS, False))
    return dataclasses.replace(kept_model(), log_format=known, outputs=outputs)


def written(path: Path, model: ActuatorModel, *names: str) -> Path:
    """A log of those columns: t (s), U (V), x (mm), R (ohm)."""
    run = sma.simulate_dataset(model.system, {"voltage": jnp.asarray(VOLTS)}, dt=0.1, tolerance=1e-6)
    noise = np.random.default_rng(5).normal(size=(2, TIME.size))
    columns = {
        "t": TIME,
        "U": VOLTS,
        "x": 1e3 * (run["reading"].to_numpy() + NOISE * noise[0]),
        "R": run["resistance"].to_numpy() + OHMS * noise[1],
    }
    np.savetxt(
        path,
        np.stack([columns[name] for name in names], axis=1),
        delimiter=",",
        header=",".join(names),
        comments="",
        fmt="%.7g",
    )
    return path


def test_a_log_without_the_loads_own_sensor_is_compared_on_what_it_has(model: ActuatorModel, tmp_path: Path) -> None:
    whole = sma.predict(model, written(tmp_path / "whole.csv", model, "t", "U", "x", "R"))
    assert whole.warnings == ()
    log = written(tmp_path / "ohms.csv", model, "t", "U", "R")
    found = sma.predict(model, log)
    (told,) = [one for one in found.warnings if "'position'" in one]
    assert (
        told
        == "the output 'position', which the model was fitted to, is not in ohms: it is predicted there and compared with nothing"
    )
    resistance, position = found.runs[0].series
    assert (resistance.output, position.output) == ("resistance", "position")
    assert resistance.rmse == pytest.approx(OHMS, rel=0.15)
    assert np.isnan(position.rmse)
    np.testing.assert_array_equal(position.reading, whole.runs[0].series[0].reading)
    assert [row[2] for row in run_rows(found)][1] == "not measured"
    assert conclusions(found)[0].startswith("The resistance of 1 run is predicted")
    path = model.save(tmp_path / "model.toml")
    ended = smajax("predict", path, log, "--out", tmp_path / "out")
    assert ended.code == 0, ended.said
    assert "note: the output 'position', which the model was fitted to, is not in ohms" in ended.out
    record = json.loads((tmp_path / "out" / "predict.json").read_text(encoding="utf-8"))
    assert record["outputs"]["position"]["rmse"] is None


def test_of_logs_with_other_sensors_each_is_compared_on_its_own(model: ActuatorModel, tmp_path: Path) -> None:
    logs = [
        written(tmp_path / "ohms.csv", model, "t", "U", "R"),
        written(tmp_path / "whole.csv", model, "t", "U", "x", "R"),
    ]
    found = sma.predict(model, logs)
    assert [run.name for run in found.runs] == ["ohms", "whole"]
    measured = [{one.output: bool(np.isfinite(one.rmse)) for one in run.series} for run in found.runs]
    assert measured == [{"resistance": True, "position": False}, {"resistance": True, "position": True}]
    assert not any("fit run" in one for one in found.warnings)


def test_a_log_with_none_of_the_models_sensors_is_refused(model: ActuatorModel, tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="no column 'x'"):
        sma.predict(model, written(tmp_path / "inputs.csv", model, "t", "U"))


def test_the_error_of_a_log_names_that_log_also_where_logs_lie_in_other_folders(
    model: ActuatorModel, tmp_path: Path
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    good = written(tmp_path / "a" / "good.csv", model, "t", "U", "x", "R")
    bad = written(tmp_path / "b" / "bad.csv", model, "t", "U")
    with pytest.raises(ExperimentError) as raised:
        sma.predict(model, [good, bad])
    assert str(raised.value).startswith(f"{bad}: no column 'x'")
    assert "runs." not in str(raised.value)
    with pytest.raises(ExperimentError) as raised:
        sma.predict(model, [good], inputs={"mass": "75 m"})
    assert str(raised.value).startswith(f"{good}: runs.good.inputs.mass: ")
