"""Identification: the truth within its standard errors, and which parameters are not identifiable."""

from __future__ import annotations

import csv
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import parameter_values, set_parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.read import read_table
from smajax.fit.design import candidate_runs
from smajax.fit.directions import Direction, directions
from smajax.fit.identify import identify
from smajax.fit.identify_result import Identified
from smajax.fit.robust import huber_weights
from smajax.fit.sensitivity import Sensitivity
from smajax.fit.uncertainty import RemarkKind
from smajax.model.presets import build
from smajax.report.identifiability_words import direction_sentence, weak_combinations
from smajax.report.identify_page import page, write_identified
from smajax.report.identify_record import record
from smajax.report.identify_words import answer, conclusions
from smajax.report.next_steps import after_identify
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.in_browser import HOSTILE, faults
from tests.helpers.small_bench import refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

TRUTH = {"austenite_start": 70.0, "austenite_finish": 82.0, "martensite_start": 55.0, "recoverable_strain": 0.044}
NOISE = 2e-4
FILE = """
title = "Coupon <of> test"
[model]
wire = "flexinol_table_3_2"
load = "coupon"
drive = "none"
[unknown]
austenite_start = { low = "50 degC", high = "79 degC", start = "60 degC" }
austenite_finish = { low = "79.5 degC", high = "110 degC", start = "95 degC" }
martensite_start = { low = "45 degC", high = "65 degC", start = "50 degC" }
recoverable_strain = { low = "1 %", high = "8 %", start = "3 %" }
[sampling]
step = "500 ms"
[time]
column = "t"
[channels.temperature]
role = "input"
column = "T"
unit = "degC"
[channels.stress]
role = "input"
column = "s"
unit = "MPa"
[channels.strain]
role = "output"
column = "e"
unit = "1"
noise = "0.02 %"
"""


def coupon_file(folder: Path, noise: float, outliers: int = 0) -> Path:
    """An experiment of three runs at two stresses, one of them held out."""
    wire = set_parameters(build("flexinol_table_3_2", "coupon", "none"), TRUTH)
    rng = np.random.default_rng(5)
    time = 0.5 * np.arange(301)
    text = FILE
    for name, role, stress, top in (
        ("a", "fit", 90.0, 110.0),
        ("b", "fit", 150.0, 95.0),
        ("c", "held-out", 120.0, 105.0),
    ):
        celsius = np.interp(time, [0.0, 60.0, 130.0, 150.0], [25.0, top, 30.0, 80.0])
        inputs = {"temperature": jnp.asarray(celsius), "stress": jnp.full(301, stress * 1e6)}
        strain = np.asarray(simulate_compiled(wire, inputs, 0.5).strain) + noise * rng.standard_normal(301)
        strain[rng.choice(301, outliers, replace=False)] += 0.02
        rows = zip(time, celsius, np.full(301, stress), strain, strict=True)
        table = "\n".join(",".join(f"{value:.12g}" for value in row) for row in rows)
        (folder / f"{name}.csv").write_text(f"t,T,s,e\n{table}\n")
        text += f'[[runs]]\nname = "{name}"\nrole = "{role}"\nfile = "{name}.csv"\n'
    (folder / "experiment.toml").write_text(text)
    return folder / "experiment.toml"


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return load_experiment(coupon_file(tmp_path_factory.mktemp("coupon"), NOISE), CATALOGUE)


@pytest.fixture(scope="module")
def found(experiment: Experiment) -> Identified:
    return identify(experiment, starts=16, profiled=["austenite_finish", "recoverable_strain"], design=True)


def test_the_truth_lies_within_the_errors(found: Identified) -> None:
    for one in found.estimates:
        assert one.standard_error is not None
        assert one.standard_error < 0.02 * abs(one.value)
        assert abs(one.value - TRUTH[one.name]) < 4.0 * one.standard_error
    assert found.ratio == pytest.approx(1.0, abs=0.1)
    assert min(found.whiteness_p, found.normality_p) > 1e-3
    assert {one.name: one.role for one in found.runs} == {"a": "fit", "b": "fit", "c": "held-out"}
    assert all(one.rmse < 1.2 * NOISE for one in found.runs)


def test_a_profile_is_the_parabola_of_its_standard_error_where_the_problem_is_nearly_linear(found: Identified) -> None:
    estimates = {one.name: one for one in found.estimates}
    for one in found.profiles:
        estimate = estimates[one.name]
        assert estimate.standard_error is not None
        assert one.low is not None
        assert one.high is not None
        half = 0.5 * (one.high - one.low)
        assert half == pytest.approx(1.96 * estimate.standard_error, rel=0.3)
        assert one.low < TRUTH[one.name] + half
        assert one.high > TRUTH[one.name] - half


def test_without_noise_every_parameter_comes_back(tmp_path: Path) -> None:
    exact = load_experiment(coupon_file(tmp_path, 0.0), CATALOGUE)
    exact = dataclasses.replace(exact, outputs=(dataclasses.replace(exact.outputs[0], noise_sigma=1e-7),))
    for one in identify(exact, starts=16).estimates:
        assert one.value == pytest.approx(TRUTH[one.name], rel=1e-4)


def test_samples_far_off_do_not_move_a_robust_fit(tmp_path: Path) -> None:
    spoilt = load_experiment(coupon_file(tmp_path, NOISE, outliers=12), CATALOGUE)
    plain, robust = (identify(spoilt, starts=0, robust=choice) for choice in (False, True))

    def off(result: Identified) -> float:
        return max(abs(one.value / TRUTH[one.name] - 1.0) for one in result.estimates)

    assert off(robust) < 0.3 * off(plain)
    assert off(robust) < 5e-3
    assert any("Huber" in sentence for sentence in conclusions(plain))


def test_another_loss_is_not_advised_where_the_model_lacks_something(found: Identified) -> None:
    skewed = dataclasses.replace(found, whiteness_p=1e-9, normality_p=1e-9)
    sigma = found.outputs[0].noise_sigma
    # Of a noise that was estimated with the fit the residual is as large as that, whatever neighbouring samples show.
    for ratio, before, advised in (
        (1.2, None, True),
        (30.0, None, False),
        (1.0, sigma, True),
        (1.0, sigma / 30.0, False),
    ):
        output = dataclasses.replace(found.outputs[0], ratio=ratio, noise_before=before)
        said = conclusions(dataclasses.replace(skewed, outputs=(output,)))
        assert any("Huber" in sentence for sentence in said) == advised


def test_a_held_out_run_that_is_off_by_far_more_than_the_fit_is_said_to_be(found: Identified) -> None:
    def said(ratio: float) -> list[str]:
        fitted = [run for run in found.runs if run.role == "fit"]
        error = float(np.sqrt(np.mean(np.square([run.rmse for run in fitted]))))
        series = dataclasses.replace(fitted[0].series[0], rmse=ratio * error)
        apart = dataclasses.replace(fitted[0], name="apart", role="held-out", series=(series,))
        return [one for one in conclusions(dataclasses.replace(found, runs=(*fitted, apart))) if "apart" in one]

    (off,) = said(2.4)
    assert off.startswith("apart, which was held out, is off by 2.4 times the error of the fit runs")
    assert said(1.4) == []


def test_huber_weights_fall_as_one_over_the_distance() -> None:
    misfit, mask = np.concatenate([np.linspace(-1.0, 1.0, 201), [50.0, 9.0]])[None], np.ones((1, 203))
    mask[0, -1] = 0.0
    weights = huber_weights(misfit, mask)[0]
    assert weights[100] == 1.0
    assert weights[-2] == pytest.approx(1.345 * 1.4826 * 0.5025 / 50.0, rel=1e-2)
    assert weights[-1] == 0.0


def test_correlated_parameters_are_reported() -> None:
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((400, 3))
    columns[:, 1] = -2.0 * columns[:, 0] + 1e-3 * columns[:, 1]
    at = Sensitivity(("a", "b", "c"), np.zeros((1, 400)), columns[None], np.ones((1, 400)))
    told = directions(at, ("a", "b", "c"), {"a": 1.0, "b": 1.0, "c": 10.0}, 1.0)
    assert set(told[0].shares) == {"a", "b", "c"}
    assert told[0].shares["b"] / told[0].shares["a"] == pytest.approx(0.5, rel=1e-2)
    sentences = weak_combinations(told)
    assert len(sentences) >= 1
    assert "a and b are correlated" in sentences[0]


def test_the_step_of_a_temperature_does_not_depend_on_its_zero() -> None:
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((400, 2))
    columns[:, 1] = -0.05 * columns[:, 0] + 1e-2 * columns[:, 1]  # 1 of `a` does what 20 K do
    at = Sensitivity(("a", "start"), np.zeros((1, 400)), columns[None], np.ones((1, 400)))
    for value in (70.0, 0.5):  # degC
        one = directions(at, ("a", "start"), {"a": 1.0, "start": value}, 1.0, ["start"])[0]
        told = re.fullmatch(
            r"a and start are correlated: a change of a by (.*) % and start by (.*) K at the same time.*",
            direction_sentence(one),
        )
        assert told is not None
        assert float(told[2]) == pytest.approx(0.2 * float(told[1]), rel=0.06)  # two digits each
    alone = Direction({"start": 1.0}, 0.1, frozenset({"start"}))
    assert direction_sentence(alone) == "start is uncertain: its standard error is 2 K."


def test_the_suggested_run_adds_information(experiment: Experiment, found: Identified) -> None:
    gains = [one.information for one in found.suggestions]
    assert len(gains) == 5
    assert gains == sorted(gains, reverse=True)
    assert all(0.0 < share <= 1.0 + 1e-9 for one in found.suggestions for share in one.shrinks.values())
    runs = [run for run in experiment.runs if run.role == "fit"]
    tried = candidate_runs(runs)
    highest = max(float(run.inputs["temperature"].max()) for run in runs)
    assert all(float(inputs["temperature"].max()) <= highest + 1e-9 for inputs in tried.values())
    # Nothing that stays cold says anything of austenite's finish: the best one transforms.
    assert found.suggestions[0].shrinks["austenite_finish"] < 0.95


def test_the_page_and_the_record_agree(found: Identified, tmp_path: Path) -> None:
    written = write_identified(found, tmp_path)
    text = written.read_text(encoding="utf-8")
    assert text == page(found, after_identify(found, tmp_path, found.source))
    assert "Coupon &lt;of&gt; test" in text
    plots = 3 + 1 + len(found.suggestions)  # runs, that of the answer, suggestions
    assert text.count('<figure class="series"') == plots
    assert text.count('src="data:image/png') == plots + 1  # profiles
    assert not re.search(r">\s*nan\b", text.lower())
    assert "The residual is as large as the noise" in " ".join(conclusions(dataclasses.replace(found, ratio=1.004)))
    assert "The residual is 1.4 times the noise" in " ".join(conclusions(dataclasses.replace(found, ratio=1.4)))
    told = json.loads((tmp_path / "identify.json").read_text(encoding="utf-8"))
    assert told == json.loads(json.dumps(record(found)))
    assert set(told["parameters"]) == set(TRUTH)
    assert told["runs"]["c"]["role"] == "held-out"
    with (tmp_path / "parameters.csv").open(encoding="utf-8") as file:
        values = {row["parameter"]: float(row["estimate"]) for row in csv.DictReader(file)}
    assert values == {name: pytest.approx(one["value"], rel=1e-9) for name, one in told["parameters"].items()}
    table = read_table(tmp_path / "runs.csv")
    left = (table.column("strain measured [1]") - table.column("strain simulated [1]")).reshape(3, -1)
    errors = [told["runs"][name]["rmse"] for name in ("a", "b", "c")]
    np.testing.assert_allclose(np.sqrt(np.mean(left**2, axis=1)), errors, rtol=1e-6)
    np.testing.assert_allclose(table.column("stress [Pa]").reshape(3, -1)[:, 0], [90e6, 150e6, 120e6])


def test_the_page_has_a_column_of_profiles_where_one_was_drawn(found: Identified) -> None:
    def first_table(one: Identified) -> list[list[str]]:
        rows = re.search(r"<table.*?</table>", page(one), re.DOTALL)
        assert rows is not None
        return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows[0].split("<tr>")[1:]]

    drawn, bare = first_table(found), first_table(dataclasses.replace(found, profiles=()))
    place = drawn[0].index("95 % (profile)")
    assert any(row[place] for row in drawn[1:])
    assert bare == [row[:place] + row[place + 1 :] for row in drawn]


def test_the_page_gives_advice_for_correlated_parameters(found: Identified) -> None:
    weak = (Direction({"a": 1.0, "b": -1.0}, 0.06),)
    alone = (Direction({"a": 1.0, "b": 0.1}, 0.09),)
    advice = "measure one by itself and give it under <code>[model.parameters]</code>"
    bare = dataclasses.replace(found, directions=weak, suggestions=())
    assert f"{advice} in the place of" in page(bare)
    assert "<code>--design</code> ranks such runs" in page(bare)
    assert "such runs are ranked below" in page(dataclasses.replace(found, directions=weak))
    assert advice not in page(dataclasses.replace(found, directions=alone))


def test_the_headline_counts_correlated_parameters_and_a_sentence_says_what_that_means(found: Identified) -> None:
    names, matrix = list(found.correlated), np.eye(len(found.correlated))
    assert "correlated" not in answer(dataclasses.replace(found, correlation=matrix))
    matrix[0, 1] = matrix[1, 0] = -0.9996
    together = dataclasses.replace(found, correlation=matrix)
    assert answer(together).startswith("4 of 4 parameters determined, 2 of them correlated: ")
    (sentence,) = [one for one in conclusions(together) if "Determined means" in one]
    assert f"Correlated (up to 0.999) are {names[0]} and {names[1]}: " in sentence


def test_the_page_has_no_fault_in_a_browser(found: Identified, browser: Any, tmp_path: Path) -> None:
    runs = (dataclasses.replace(found.runs[0], name=HOSTILE), *found.runs[1:])
    assert faults(browser, write_identified(dataclasses.replace(found, title=HOSTILE, runs=runs), tmp_path)) == []


@pytest.mark.slow
def test_correlations_of_many_parameters_scroll_sideways_in_a_narrow_window(
    found: Identified, browser: Any, tmp_path: Path
) -> None:
    names = tuple(f"parameter_{k}" for k in range(12))
    correlation = np.asarray(np.corrcoef(np.random.default_rng(3).normal(size=(12, 20))))
    many = dataclasses.replace(found, correlated=names, correlation=correlation)
    shown = browser.new_page(viewport={"width": 400, "height": 900})
    shown.goto(write_identified(many, tmp_path).as_uri())
    box = next(one for one in shown.query_selector_all(".scroll") if "parameter_0" in one.inner_text())
    rows = [[cell.inner_text() for cell in row.query_selector_all("td")] for row in box.query_selector_all("tbody tr")]
    assert [row[0].split()[1] for row in rows] == list(names)
    np.testing.assert_allclose(np.array([row[1:] for row in rows], float), correlation, atol=0.0051)
    assert box.evaluate("box => box.scrollWidth > box.clientWidth && box.clientWidth <= 400")
    assert all(
        cell.evaluate("cell => parseFloat(getComputedStyle(cell).fontSize) >= 12")
        for cell in box.query_selector_all("td")
    )
    assert "Correlations of the estimates" not in page(dataclasses.replace(many, correlated=names[:1]))


def test_an_effect_is_part_of_the_model_when_a_parameter_of_it_is_named(tmp_path: Path) -> None:
    path = coupon_file(tmp_path, NOISE)
    text = path.read_text().replace(
        "[sampling]",
        '"thermal_expansion.austenite" = { low = "-5e-5 1/K", high = "5e-5 1/K", start = "0 1/K" }\n[sampling]',
    )
    path.write_text(text)
    known = load_experiment(path, CATALOGUE)
    assert known.declared_effects == ("thermal_expansion",)
    expansion = next(one for one in identify(known, starts=0).estimates if "." in one.name)
    assert expansion.standard_error is not None
    assert abs(expansion.value) < 4.0 * expansion.standard_error


def test_a_fit_at_the_bound_of_its_box_is_reported(tmp_path: Path) -> None:
    path = coupon_file(tmp_path, NOISE)
    path.write_text(path.read_text().replace('high = "8 %"', 'high = "4 %"'))
    strain = next(
        one
        for one in identify(load_experiment(path, CATALOGUE), starts=0).estimates
        if one.name == "recoverable_strain"
    )
    assert strain.value == pytest.approx(0.04, rel=1e-3)
    assert strain.standard_error is None
    assert strain.note.kind is RemarkKind.UPPER_BOUND


def test_the_command_reports_what_is_wrong(tmp_path: Path) -> None:
    path = coupon_file(tmp_path, NOISE)

    wrong = refused("identify", path, "--out", tmp_path / "out", "--profile", "austenite_strat")
    assert "austenite_strat" in wrong
    assert "austenite_start" in wrong
    path.write_text("\n".join(line for line in path.read_text().splitlines() if "low =" not in line))
    assert "unknown" in refused("identify", path, "--out", tmp_path / "out")


def test_a_value_that_the_file_does_not_give_may_be_fitted_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slope that is 12 % off the preset's: held, the fit leaves more than noise and says what it holds; fitted, it is found."""
    preset = parameter_values(build("flexinol_table_3_2", "coupon", "none"))["stress_slope_austenite"]
    monkeypatch.setitem(TRUTH, "stress_slope_austenite", 0.88 * preset)
    file = coupon_file(tmp_path, NOISE)
    # One with a base of its own in the file is fitted too, and no longer held.
    own = 'young_modulus_austenite = { base = "75 GPa", relative = 0.1 }'
    file.write_text(f"{file.read_text(encoding='utf-8')}\n[priors.presets]\n{own}\n", encoding="utf-8")
    records = {
        how: json.loads(
            smajax("identify", file, "--starts", "0", "--presets", how, "--out", tmp_path / how, "--json").out
        )
        for how in ("held", "fitted")
    }
    held, fitted = records["held"], records["fitted"]
    assert any("Held at the preset's value" in line for line in held["conclusions"])
    assert "Held at the preset" in (tmp_path / "held" / "identify.html").read_text(encoding="utf-8").split("<h2>")[0]
    assert "stress_slope_austenite" in held["presets"]["held"]
    assert held["presets"]["held"] == fitted["presets"]["fitted"]
    assert not fitted["presets"]["held"]
    again = [(tmp_path / how / "identify.html").read_text(encoding="utf-8") for how in ("held", "fitted")]
    assert ["--presets fitted --design" in text for text in again] == [False, True]
    assert held["residual"]["rms_over_noise"] > 1.3
    assert any("stress_slope_austenite" in line and "--presets fitted" in line for line in held["check"])
    assert fitted["residual"]["rms_over_noise"] == pytest.approx(1.0, abs=0.1)
    assert not any("--presets" in line for line in fitted["check"])
    slope = fitted["parameters"]["stress_slope_austenite"]
    assert abs(slope["value"] - 0.88 * preset) < 4.0 * slope["standard_error"]
    assert slope["standard_error"] < 0.05 * preset
    assert refused("identify", file, "--starts", "0", "--presets", "fitted", "--out", tmp_path / "held")


def test_the_sentences_that_the_result_held_are_there_with_a_warning(found: Identified) -> None:
    written = record(found)
    with pytest.warns(DeprecationWarning, match=r"identified.stopped is smajax.report.narrate\(identified\).ended now"):
        assert found.stopped == written["fits"]["stopped"]
    with pytest.warns(DeprecationWarning, match="identified.check is"):
        assert list(found.check) == written["check"]
    with pytest.warns(DeprecationWarning, match="identified.weak is"):
        assert list(found.weak) == written["weak_combinations"]
    with pytest.warns(DeprecationWarning, match="estimate.remark is"):
        assert [one.remark for one in found.estimates] == [one["remark"] for one in written["parameters"].values()]
