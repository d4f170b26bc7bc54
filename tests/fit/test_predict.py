"""A kept model against runs: its reading, its band, and where a run is outside of what the model was fitted to."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.data.experiment.errors import ExperimentError
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_presets import model_of_presets
from smajax.data.model_file.record import FittedRun, LikelyModel, ModelOutput
from smajax.fit.predict import Prediction
from smajax.fit.prediction_band import averaged_band, moving
from smajax.report.csv_files import predicted_runs
from smajax.report.predict_page import page, record
from smajax.report.predict_words import HEAD, conclusions, run_rows
from tests.helpers.often import often
from tests.helpers.small_bench import bench, smajax, table

pytestmark = pytest.mark.usefixtures("blank_pictures")

VALUES = {"convection_coefficient": 90.0, "specific_heat": 500.0}
TIME = np.arange(0.0, 30.0, 0.1)
VOLTS = np.where((TIME > 2.0) & (TIME < 15.0), 5.0, np.where(TIME < 22.0, 0.0, 4.0))
NOISE = 1e-4  # m


def kept_model(volts: float = 5.0) -> ActuatorModel:
    """The preset's dead weight with two values known to a per cent, fitted to runs of up to `volts`."""
    preset = model_of_presets("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
    known = dict(preset.parameters)
    for name, value in VALUES.items():
        known[name] = dataclasses.replace(known[name], value=value, origin="fitted", standard_error=0.01 * value)
    covariance = np.diag([(0.01 * value) ** 2 for value in VALUES.values()])
    return dataclasses.replace(
        preset,
        title="bench",
        parameters=known,
        outputs=(ModelOutput("position", "m", NOISE, False),),
        likely=(LikelyModel((), 1.0, VALUES, tuple(VALUES), covariance),),
        fitted_range={"voltage": (0.0, volts), "temperature": (20.0, 200.0)},
    )


def reading(model: ActuatorModel, **values: float) -> np.ndarray:
    """What the load's sensor shows over `VOLTS`, m."""
    system = sma.set_parameters(model.system, values)
    run = sma.simulate_dataset(system, {"voltage": jnp.asarray(VOLTS)}, dt=0.1, tolerance=1e-6)
    return run["reading"].to_numpy()


def log(path: Path, position: np.ndarray, noise: float = NOISE, heading: str = "t [s],U [V],x [mm]") -> Path:
    position = position + np.random.default_rng(5).normal(0.0, noise, position.size)
    return table(path, TIME, VOLTS, 1e3 * position, heading)


def of(prediction: Prediction) -> np.ndarray:
    return prediction.runs[0].series[0].reading


def test_a_run_of_the_same_wire_is_predicted_to_its_noise_and_nine_of_ten_samples_lie_in_the_band(
    tmp_path: Path,
) -> None:
    model = kept_model()
    truth = reading(model)
    result = sma.predict(model, log(tmp_path / "run.csv", truth))
    one = result.runs[0].series[0]
    np.testing.assert_allclose(one.reading, truth, atol=0.1 * NOISE)
    assert one.rmse == pytest.approx(NOISE, rel=0.15)
    assert 0.85 < one.coverage <= 1.0
    assert not result.runs[0].fitted
    assert not result.runs[0].extrapolation
    assert "0.96 times the noise of 0.1 mm; 92% of the samples lie in the 90 % band" in conclusions(result)[0]


@pytest.mark.parametrize("wires", often([4, 12], [4]))
def test_the_band_holds_wires_that_differ_as_the_parameters_errors_say(wires: int, tmp_path: Path) -> None:
    model = kept_model()
    inside = []
    for number, plant in enumerate(model.draws(wires, seed=4)):
        values = {name: float(sma.parameter_values(plant)[name]) for name in VALUES}
        path = log(tmp_path / f"{number}.csv", reading(model, **values), noise=1e-6)
        one = sma.predict(dataclasses.replace(model, outputs=(ModelOutput("position", "m", 1e-6, False),)), path).runs[
            0
        ]
        moving = one.series[0].half_width > 1e-5
        error = np.abs(one.series[0].measured - one.series[0].reading)
        inside.append(np.mean((error <= one.series[0].half_width)[moving]))
    assert 0.7 < np.mean(inside) < 1.0  # of runs, not of samples


def test_a_zero_of_the_sensor_is_each_runs_own_only_where_the_model_has_one(tmp_path: Path) -> None:
    model = kept_model()
    path = log(tmp_path / "run.csv", reading(model) + 3e-3)
    assert sma.predict(model, path).runs[0].series[0].rmse == pytest.approx(3e-3, rel=0.05)
    own = dataclasses.replace(model, outputs=(ModelOutput("position", "m", NOISE, True),))
    result = sma.predict(own, path)
    one = result.runs[0].series[0]
    assert one.rmse == pytest.approx(NOISE, rel=0.15)
    assert one.offset == pytest.approx(3e-3, rel=0.02)
    shown = f"{1e3 * one.offset:.3g}"
    assert dict(zip(HEAD, run_rows(result)[0], strict=True))["zero, fitted"] == shown
    assert f"<td>{shown}</td>" in re.sub("<td [^>]*>", "<td>", page(result))
    (said,) = [one for one in conclusions(result) if one.startswith("The zero of the position is fitted to each run")]
    assert f"run has {shown} mm, 29.9 times the noise. Where" in said
    # One of a noise or two is in the table alone, and where the model has none there is no number.
    near = sma.predict(own, log(tmp_path / "near.csv", reading(model) + 2.0 * NOISE))
    assert float(run_rows(near)[0][HEAD.index("zero, fitted")]) == pytest.approx(0.2, abs=0.02)
    assert not any("zero" in sentence for sentence in conclusions(near))
    assert run_rows(sma.predict(model, path))[0][HEAD.index("zero, fitted")] == ""


def test_the_offset_of_an_average_of_models_is_the_average_of_theirs(tmp_path: Path) -> None:
    single = kept_model()
    single = dataclasses.replace(single, outputs=(ModelOutput("position", "m", NOISE, True),))
    first = single.likely[0]
    other = dataclasses.replace(first, values={**VALUES, "convection_coefficient": 110.0}, probability=0.4)
    path = log(tmp_path / "run.csv", reading(single) + 3e-3)

    def offset(*likely: LikelyModel) -> float:
        return sma.predict(dataclasses.replace(single, likely=likely), path).runs[0].series[0].offset

    alone = [offset(dataclasses.replace(one, probability=1.0)) for one in (first, other)]
    assert abs(alone[1] - alone[0]) > 2.0 * NOISE
    both = offset(dataclasses.replace(first, probability=0.6), other)
    assert both == pytest.approx(0.6 * alone[0] + 0.4 * alone[1], rel=1e-9)


def test_an_output_moves_where_its_means_before_and_after_a_sample_differ_by_more_than_two_noises() -> None:
    random = np.random.default_rng(3)
    way = np.concatenate([np.zeros(5000), np.arange(100.0), np.full(5000, 100.0)])  # a noise a sample
    moves = moving(way + random.normal(0.0, 1.0, way.size), 1.0)
    assert moves[5005:5095].all()
    at_rest = np.concatenate([moves[:4990], moves[5110:]])
    assert 0.0 < np.mean(at_rest) < 0.005
    lost = np.where(np.arange(way.size) % 7 == 0, np.nan, way)
    assert not moving(lost, 1.0)[::7].any()
    assert not moving(np.full(20, np.nan), 1.0).any()
    assert not moving(np.array([1.0]), 1.0).any()


def test_samples_at_rest_do_not_hide_that_a_model_is_wrong_where_its_output_moves(tmp_path: Path) -> None:
    """A wire that cools a third more slowly is where the model says as long as nothing happens."""
    model = kept_model()
    result = sma.predict(model, log(tmp_path / "run.csv", reading(model, convection_coefficient=70.0)))
    one = result.runs[0].series[0]
    assert one.moving_coverage < one.coverage - 0.1
    assert result.errors[0].moving_coverage == one.moving_coverage
    share = round(100 * one.moving_coverage)
    assert (
        f" of the samples lie in the 90 % band ({share}% of those at which the output moves)." in conclusions(result)[0]
    )
    assert run_rows(result)[0][HEAD.index("in it while moving")] == f"{share}%"
    inside = np.abs(one.measured - one.reading) <= one.half_width
    assert np.mean(inside[one.moving]) == one.moving_coverage
    assert record(result)["runs"][0]["outputs"]["position"]["band_coverage_moving"] == one.moving_coverage
    assert predicted_runs(result).splitlines()[0].endswith("position moves [1]")
    assert "differ by more than 2 noises" in page(result)


def test_the_average_of_likely_models_lies_between_them_with_their_difference_in_the_band() -> None:
    readings, variances = np.array([[[0.0, 0.0]], [[1.0, 2.0]]]), np.zeros((2, 1, 2))
    mean, half = averaged_band(readings, variances, np.array([0.75, 0.25]), 0.0)
    np.testing.assert_allclose(mean, [[0.25, 0.5]])
    # The variance of a mixture of two points: w (1 - w) d^2; 1.645 standard deviations.
    np.testing.assert_allclose(half, 1.6448536 * np.sqrt(0.75 * 0.25) * np.array([[1.0, 2.0]]), rtol=1e-6)


def test_a_run_beyond_the_fitted_range_is_said_to_be_extrapolation_with_where(tmp_path: Path) -> None:
    model = kept_model(volts=4.2)
    result = sma.predict(model, log(tmp_path / "run.csv", reading(model)))
    (beyond,) = result.runs[0].extrapolation
    assert beyond.quantity == "voltage"
    assert beyond.reached == (0.0, 5.0)
    np.testing.assert_allclose(beyond.spans, [(2.1, 14.9)], atol=0.11)
    text = conclusions(result)[-1]
    assert "Extrapolation in run: voltage goes up to 5 V; the model was fitted to 0 to 4.2 V" in text


@pytest.mark.slow  # an input's range is above
def test_a_value_of_these_runs_that_no_run_of_the_fit_had_is_extrapolation(tmp_path: Path) -> None:
    model = kept_model()
    path = log(tmp_path / "run.csv", reading(model))
    model = dataclasses.replace(model, runs=(FittedRun("steps", "fit", ""),))
    assert (
        not sma.predict(model, path, parameters={"damping": f"{model.values['damping']} N s/m"}).runs[0].extrapolation
    )
    result = sma.predict(model, path, parameters={"damping": f"{2.0 * model.values['damping']} N s/m"})
    (beyond,) = result.runs[0].extrapolation
    assert (beyond.quantity, beyond.share) == ("damping", 1.0)
    assert beyond.fitted == (model.values["damping"],) * 2
    ranged = dataclasses.replace(model, fitted_range={**model.fitted_range, "damping": (50.0, 1000.0)})
    assert not sma.predict(ranged, path, parameters={"damping": "900 N s/m"}).runs[0].extrapolation
    assert any("Extrapolation in run: damping" in one for one in conclusions(result))


def test_a_log_that_does_not_say_what_runs_of_the_fit_differed_in_gets_a_hint_at_the_option(tmp_path: Path) -> None:
    model = kept_model()
    path = log(tmp_path / "run.csv", reading(model))
    ranges = {"mass": (0.05, 0.2), "ambient_temperature": (22.0, 22.0), "damping": (50.0, 1000.0)}
    ranged = dataclasses.replace(model, fitted_range={**model.fitted_range, **ranges})
    mass, damping = (one for one in sma.predict(ranged, path).warnings if "these runs do not say theirs" in one)
    assert mass == (
        "mass was 50 to 200 g in the runs that the model was fitted to, and these runs do not say theirs: 75 g is taken; give it with --input mass=..., "
        "or in [[runs]] inputs"
    )
    assert "give it with --set damping=..., or in [[runs]] parameters" in damping
    by_input = sma.predict(ranged, path, inputs={"mass": "80 g"}).warnings
    by_parameter = sma.predict(ranged, path, parameters={"load_mass": "80 g"}).warnings
    assert not any(one.startswith("mass was") for one in (*by_input, *by_parameter))


def test_a_run_that_the_model_was_fitted_to_is_said_to_be_one(tmp_path: Path) -> None:
    model = kept_model()
    path = log(tmp_path / "run.csv", reading(model))
    digest = sma.predict(model, path).runs[0].sha256
    known = dataclasses.replace(model, runs=(FittedRun("steps", "fit", digest),))
    result = sma.predict(known, path)
    assert result.runs[0].fitted
    assert any("was fitted to run" in one for one in conclusions(result))


def test_missing_samples_are_predicted_and_not_counted(tmp_path: Path) -> None:
    model, path = kept_model(), bench(tmp_path, ('noise = "0.1 mm"', 'noise = "0.1 mm"\nmissing = "skip"'))
    text = path.read_text(encoding="utf-8").replace('drive = "voltage"', 'drive = "flexinol_voltage"')
    path.write_text(text, encoding="utf-8")
    truth = reading(model)
    rows = np.stack([TIME, VOLTS, 1e3 * truth], axis=1)
    lines = [",".join(f"{one:.6g}" for one in row) for row in rows]
    lines[100:140] = [f"{row[0]:.6g},{row[1]:.6g}," for row in rows[100:140]]
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t,U,x\n" + "\n".join(lines) + "\n", encoding="utf-8")
    one = sma.predict(model, path).runs[0].series[0]
    assert np.isnan(one.measured[105:135]).all()
    np.testing.assert_allclose(one.reading, truth, atol=0.1 * NOISE)
    assert one.rmse < 0.2 * NOISE


def test_columns_are_those_of_the_models_logs_or_guessed(tmp_path: Path) -> None:
    model = kept_model()
    path = log(tmp_path / "run.csv", reading(model))
    guessed = sma.predict(model, path)
    assert any("position in mm" in one for one in guessed.warnings)
    file = bench(tmp_path / "other", ('drive = "voltage"', 'drive = "flexinol_voltage"'))
    known = dataclasses.replace(model, log_format=sma.load_experiment(file).log_format)
    again = log(tmp_path / "again.csv", reading(model), heading="t,U,x")
    result = sma.predict(known, [again, again.rename(tmp_path / "b.csv")][1:])
    np.testing.assert_array_equal(of(result), of(guessed))
    assert result.warnings == ()


@pytest.mark.parametrize(
    ("logs", "said"),
    [
        (["none.csv"], r"none\.csv: there is no such file; expected a log, or an experiment file"),
        (["bench/experiment.toml", "run.csv"], r"is an experiment file beside other files; give it alone"),
        (["strange.csv"], r"strange\.csv: .*or give an experiment file, which says what its columns are"),
    ],
)
def test_what_cannot_be_predicted_is_refused_by_name(tmp_path: Path, logs: list[str], said: str) -> None:
    model = kept_model()
    bench(tmp_path / "bench")
    log(tmp_path / "run.csv", reading(model))
    table(tmp_path / "strange.csv", TIME, VOLTS, VOLTS, "foo,bar,baz")
    with pytest.raises(ExperimentError, match=said):
        sma.predict(model, [tmp_path / one for one in logs])


def test_known_values_of_an_experiment_file_hold_in_its_runs_where_the_model_has_not_fitted_them(
    tmp_path: Path,
) -> None:
    model = kept_model()
    drive = (
        'drive = "voltage"\n',
        'drive = "flexinol_voltage"\n[model.parameters]\nload_mass = "0.5 kg"\nspecific_heat = "400 J/kg/K"\n',
    )
    file = bench(tmp_path, drive)
    for name in ("a.csv", "b.csv"):
        log(tmp_path / name, reading(model, load_mass=0.5), heading="t,U,x")
    result = sma.predict(model, file)
    assert result.runs[0].series[0].rmse == pytest.approx(NOISE, rel=0.15)
    said = "\n".join(result.warnings)
    assert "load_mass: the file gives 0.5 kg, the model has 0.075 kg; the file's is used" in said
    assert "specific_heat: the file gives 400 J/(kg K), the model has 500 J/(kg K), fitted, which is used" in said
    assert "held out" not in said


def test_a_log_without_an_input_of_the_models_logs_is_refused(tmp_path: Path) -> None:
    model = kept_model()
    mass = '[channels.mass]\nrole = "input"\ncolumn = "m"\nunit = "kg"\n[channels.position]'
    file = bench(tmp_path, ("[channels.position]", mass), ('drive = "voltage"', 'drive = "flexinol_voltage"'))
    text = file.read_text(encoding="utf-8")
    from smajax.data.experiment.schema import ExperimentFile

    log_format = ExperimentFile.model_validate(tomllib.loads(text)).log_format
    known = dataclasses.replace(model, log_format=log_format)
    run = log(tmp_path / "run.csv", reading(model))
    with pytest.raises(
        ExperimentError, match=r"no column for the input 'mass'.*give a constant with --input mass=\.\.\."
    ):
        sma.predict(known, run)
    assert sma.predict(known, run, inputs={"mass": "75 g"}).runs[0].series[0].rmse == pytest.approx(NOISE, rel=0.15)


def test_runs_of_another_drive_and_values_that_the_model_has_not_are_refused(tmp_path: Path) -> None:
    with pytest.raises(
        ExperimentError, match=r"model\.drive: got 'voltage', expected that of the model, 'flexinol_voltage'"
    ):
        sma.predict(kept_model(), bench(tmp_path))
    own = ('file = "a.csv"', 'file = "a.csv"\nparameters = { "creep.austenite" = "1e-12 1/Pa" }')
    file = bench(tmp_path, ('drive = "voltage"', 'drive = "flexinol_voltage"'), own)
    with pytest.raises(ExperimentError, match=r"runs\.A\.parameters\.creep\.austenite: is no parameter of the model"):
        sma.predict(kept_model(), file)


def test_runs_of_another_load_are_refused(tmp_path: Path) -> None:
    file = bench(tmp_path, ('load = "dead_weight"', 'load = "bias_spring"'))
    with pytest.raises(ExperimentError, match=r"got 'bias_spring', expected that of the model, 'dead_weight'"):
        sma.predict(kept_model(), file)


def test_the_command_writes_page_record_and_series_and_a_saved_model_predicts_the_same_bytes(tmp_path: Path) -> None:
    model = kept_model()
    path = model.save(tmp_path / "model.toml")
    run = log(tmp_path / "run.csv", reading(model))
    ended = smajax("predict", path, run, "--out", tmp_path / "out")
    assert ended.code == 0, ended.said
    assert "is predicted with an error (rms) of" in ended.out
    written = {one.name for one in (tmp_path / "out").iterdir() if not one.name.startswith(".")}
    assert written == {"predict.html", "predict.json", "runs.csv"}
    from smajax.report.csv_files import predicted_runs

    assert (tmp_path / "out" / "runs.csv").read_text(encoding="utf-8") == predicted_runs(sma.predict(model, run))
    again = smajax("predict", path, run, "--out", tmp_path / "out", "--json")
    assert '"band_coverage"' in again.out
    one = sma.predict(sma.load_model(path), run)
    assert of(one).tobytes() == of(sma.predict(model, run)).tobytes()
    assert one.runs[0].series[0].half_width.tobytes() == sma.predict(model, run).runs[0].series[0].half_width.tobytes()


@pytest.mark.slow  # by Python above
def test_values_and_constant_inputs_of_the_runs_may_be_given_with_the_command(tmp_path: Path) -> None:
    model = kept_model()
    path = model.save(tmp_path / "model.toml")
    run = log(tmp_path / "run.csv", reading(model, load_mass=0.5))
    wrong = sma.predict(model, run).runs[0].series[0].rmse
    for words in (["--set", "load_mass=500 g"], ["--input", "mass=0.5 kg"]):
        ended = smajax("predict", path, run, *words, "--out", tmp_path / words[0].strip("-"))
        assert ended.code == 0, ended.said
    right = sma.predict(model, run, parameters={"load_mass": "500 g"}).runs[0].series[0]
    assert wrong > 3.0 * NOISE
    assert right.rmse == pytest.approx(NOISE, rel=0.15)
    mass = sma.predict(model, run, inputs={"mass": "0.5 kg"}).runs[0]
    assert mass.series[0].rmse == pytest.approx(NOISE, rel=0.15)
    assert smajax("predict", path, run, "--set", "load_mas=1 kg", "--out", tmp_path / "x").code == 2
