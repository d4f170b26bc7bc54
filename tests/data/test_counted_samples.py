"""Logs without a time: samples are counted, and the experiment file may say how far apart they are."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from smajax.data.experiment.draft import draft
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.load import load_experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.read import load_model
from smajax.data.model_file.read_logs import read_logs
from smajax.data.model_file.record import ModelOutput
from smajax.data.model_file.write import model_text

SPRING = """
[model]
wire = "flexinol_ht_500um"
load = "bias_spring"
drive = "voltage"
[time]
kind = "sample"
{sampling}
[channels.voltage]
role = "input"
column = "voltage_V"
unit = "V"
[channels.position]
role = "output"
column = "position_mm"
unit = "mm"
noise = "0.01 mm"
[[runs]]
name = "a"
role = "fit"
file = "a.csv"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    volts = np.repeat([0.0, 6.0, 0.0], 40)
    rows = np.stack([volts, np.cumsum(volts) / 100.0], axis=1)
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="voltage_V,position_mm", comments="")
    return tmp_path / "experiment.toml"


def test_samples_are_as_far_apart_as_the_file_says(bench: Path) -> None:
    bench.write_text(SPRING.format(sampling='[sampling]\nstep = "50 ms"'))
    found = load_experiment(bench, CATALOGUE)
    np.testing.assert_allclose(found.runs[0].time, 0.05 * np.arange(120), atol=1e-12)
    assert (found.step, found.clocked) == (0.05, True)
    # Each sample is as logged, and none lies between two.
    np.testing.assert_allclose(found.runs[0].inputs["voltage"], np.repeat([0.0, 6.0, 0.0], 40), rtol=1e-12)
    np.testing.assert_allclose(found.runs[0].outputs["position"][40:42], [6e-5, 12e-5], rtol=1e-12)


def test_a_heated_wire_needs_the_time_between_samples(bench: Path) -> None:
    """It was taken for a second, without a word, and everything that was fitted was wrong."""
    bench.write_text(SPRING.format(sampling=""))
    with pytest.raises(ExperimentError, match=r"sampling: is missing; .* step = '50 ms' or so, the time from one"):
        load_experiment(bench, CATALOGUE)


def test_a_draft_asks_for_the_time_between_samples(bench: Path) -> None:
    drafted = draft([bench.parent / "a.csv"], bench)
    assert "time: none found, samples are counted" in drafted.messages[0]
    assert "write the time from one sample to the next as step under [sampling]" in drafted.messages[0]
    asked = (
        '# [sampling]\n# step = "50 ms"  # the time from one sample to the next: of a heated wire it has to be given'
    )
    assert asked in drafted.text
    bench.write_text(drafted.text.replace("# [sampling]\n# step", "[sampling]\nstep"))
    assert load_experiment(bench, CATALOGUE).step == 0.05


def test_a_signal_with_times_of_its_own_keeps_them(bench: Path) -> None:
    """A MATLAB structure beside a text file without a time."""
    volts = np.repeat([0.0, 6.0, 0.0], 400)
    record = {"time": 0.01 * np.arange(volts.size), "signals": {"values": volts}, "blockName": "m"}
    scipy.io.savemat(bench.parent / "u.mat", {"U": record})
    text = SPRING.format(sampling='[sampling]\nstep = "100 ms"').replace('column = "voltage_V"', 'variable = "U"')
    bench.write_text(text.replace('file = "a.csv"', 'files = { voltage = "u.mat", position = "a.csv" }'))
    (run,) = load_experiment(bench, CATALOGUE).runs
    np.testing.assert_allclose(run.time[-1], 11.9)
    np.testing.assert_allclose(run.inputs["voltage"][[39, 40, 79, 80]], [0.0, 6.0, 6.0, 0.0], atol=1e-9)


def test_logs_of_two_rates_are_named(bench: Path) -> None:
    np.savetxt(bench.parent / "v.csv", np.repeat([0.0, 6.0, 0.0], 400), header="voltage_V", comments="")
    text = SPRING.format(sampling='[sampling]\nstep = "100 ms"')
    bench.write_text(text.replace('file = "a.csv"', 'files = { voltage = "v.csv", position = "a.csv" }'))
    said = " ".join(load_experiment(bench, CATALOGUE).warnings)
    assert "only 11.9 s are common to all signals" in said
    assert "have these logs the same rate?" in said


COUPON = """
[model]
wire = "flexinol_table_3_2"
load = "coupon"
drive = "none"
[time]
kind = "sample"
[sampling]
step = "30 s"
[channels.temperature]
role = "input"
column = "T_degC"
unit = "degC"
[channels.stress]
role = "input"
column = "stress_MPa"
unit = "MPa"
[channels.strain]
role = "output"
column = "strain_1"
unit = "1"
noise = "0.0001 1"
[[runs]]
name = "a"
role = "fit"
file = "a.csv"
"""


@pytest.mark.parametrize("heading", ["T_degC,stress_MPa,strain_1", "temperature_degC,sigma_MPa,eps_1"])
def test_a_log_that_is_predicted_has_the_models_time_between_samples(tmp_path: Path, heading: str) -> None:
    """Whether its columns have the names of the model's logs or are guessed."""
    turn = np.linspace(0.0, 2.0 * np.pi, 120)
    rows = np.stack([25.0 + 60.0 * np.abs(np.sin(turn)), 150.0 + turn, 0.02 + 0.02 * np.cos(2.0 * turn)], axis=1)
    for name, columns in (("a", "T_degC,stress_MPa,strain_1"), ("b", heading)):
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header=columns, comments="")
    (tmp_path / "experiment.toml").write_text(COUPON)
    fitted = load_experiment(tmp_path / "experiment.toml", CATALOGUE)
    outputs = (ModelOutput("strain", "-", 1e-4, False),)
    model = model_of_presets("flexinol_table_3_2", "coupon", "none")
    kept = dataclasses.replace(model, log_format=fitted.log_format, outputs=outputs)
    (tmp_path / "model.toml").write_text(model_text(kept))
    found, _ = read_logs(load_model(tmp_path / "model.toml"), [tmp_path / "b.csv"])
    assert (found.step, found.clocked) == (30.0, True)
    np.testing.assert_allclose(found.runs[0].time[-1], 30.0 * 119)
