"""What an experiment file may declare beside one output: `close_loop` takes all of it, as `identify` does.

A coupon by the benchmark's own code (`studies.attribution_benchmark`): strain, of which samples are missing, and resistance; an
austenite start of each run's own; an unknown with a prior.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import Findings, Verdict, pooled_rmse, pooled_rmse_of
from smajax.attribution.job import job_of
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.identify import identify
from smajax.fit.predicted import misfits, sums_of_squares
from smajax.report.csv_files import findings_runs
from smajax.report.html import findings_to_html
from smajax.report.json_file import findings_to_json
from smajax.report.narrative import narrate
from studies.attribution_benchmark.coupon import strain
from studies.attribution_benchmark.rigs import COUPON, show
from studies.attribution_benchmark.runs import Run
from studies.attribution_benchmark.write import experiment_text, table_text

OHMS = 2e-5  # noise of the resistance
LOST = slice(100, 120)  # samples of the strain that are missing
EVERY = 2  # samples that are kept, of a run of 401
ROLES = {"low": "fit", "high": "fit", "middle": "held-out"}
APART = (3.0, -2.0, 1.0)  # K: austenite start of each run about the nominal one
OTHER = """
[channels.resistance]
role = "output"
column = "resistance"
unit = "ohm"
noise = "2e-05 ohm"
offset = false
"""
CANDIDATES = ["thermal_expansion", "residual_strain", "stress_dependent_strain", "phase_resistance", "sensor_gain"]
HIDDEN = {"thermal_expansion": 1.2e-5}


def bench(folder: Path, effects: dict[str, float], own: bool = False, only: str = "") -> Experiment:
    """Two fit runs and one held out. own: an austenite start of each run, and a prior of the martensite start. only: the one output."""
    random = np.random.default_rng(5)
    rig = COUPON
    by_name = {run.name: run for run in rig.runs(rig.wire)}
    runs = [dataclasses.replace(by_name[name], role=role) for name, role in ROLES.items()]
    for run, apart in zip(runs, APART, strict=True):
        wire = dataclasses.replace(rig.wire, recoverable_strain=1.05 * rig.wire.recoverable_strain)
        if own:
            wire = dataclasses.replace(wire, austenite_start=wire.austenite_start + apart)
        # Without a thermal strain what is left of the strain is the fraction.
        plain = dataclasses.replace(wire, thermal_modulus=0.0)
        fraction = 1.0 + strain(plain, rig.clock.times, run, {}) / wire.recoverable_strain
        resistivity = wire.resistivity_austenite + fraction * (wire.resistivity_martensite - wire.resistivity_austenite)
        ohms = resistivity * wire.wire_length / wire.area
        _write(folder, run, show(rig, wire, run, effects) + random.normal(0.0, rig.noise, ohms.size), ohms, random)
    text = experiment_text(rig, tuple(runs))
    place = text.index("noise =", text.index("[channels.strain]"))
    text = text[:place] + 'missing = "skip"\n' + text[place:]
    text = text.replace("\n[time]", f"{OTHER}\n[time]").replace('"1000 ms"', f'"{EVERY} s"')
    if only == "resistance":
        first = text.index("[channels.strain]")
        text = text[:first] + text[text.index("[channels.resistance]") :]
    if own:
        text = text.replace("austenite_start = {", "austenite_start = { per_run = true,")
        text = text.replace("martensite_start = {", 'martensite_start = { prior = { mean = "54 degC", sigma = "1 K" },')
    text += f"[effects]\nonly = {CANDIDATES}\n"
    (folder / "experiment.toml").write_text(text)
    return load_experiment(folder / "experiment.toml", CATALOGUE)


def _write(folder: Path, run: Run, read: np.ndarray, ohms: np.ndarray, random: np.random.Generator) -> None:
    head, *rows = table_text(COUPON, run, read).splitlines()
    lines = [f"{head},resistance"]
    for number, (row, value) in enumerate(zip(rows, ohms + random.normal(0.0, OHMS, ohms.size), strict=True)):
        cells = row.split(",")
        if LOST.start <= number < LOST.stop:
            cells[-1] = "nan"
        lines.append(f"{','.join(cells)},{value:.8g}")
    kept = [lines[0], *lines[1::EVERY]]
    (folder / f"{run.name}.csv").write_text("\n".join(kept) + "\n")


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return bench(tmp_path_factory.mktemp("own"), HIDDEN, own=True)


@pytest.fixture(scope="module")
def found(experiment: Experiment) -> Findings:
    return close_loop(experiment)


def test_the_hidden_effect_is_found_beside_values_of_the_runs_own_and_a_prior(found: Findings) -> None:
    assert found.verdict is Verdict.EXPLAINED
    assert [effect.name for effect in found.added] == ["thermal_expansion"]
    strained, others = (
        [measure(which) for which in ("before", "after")]
        for measure in (
            lambda which: pooled_rmse(found.runs, "held-out", which),
            lambda which: pooled_rmse_of(found.runs, "resistance", "held-out", which),
        )
    )
    assert strained[1] < 1.15 * found.noise_sigma < strained[0] / 1.5
    assert others[1] < 1.15 * OHMS
    after = {one.name: one for one in found.after}
    nominal = COUPON.wire.austenite_start
    for run, apart in zip(("low", "high"), APART, strict=False):
        one = after[f"austenite_start[{run}]"]
        assert one.standard_error is not None
        assert one.value == pytest.approx(nominal + apart, abs=4.0 * one.standard_error)
    assert after["martensite_start"].prior_of_unknown
    assert after["martensite_start"].prior_base == 54.0


def test_a_missing_sample_counts_nowhere(found: Findings, experiment: Experiment) -> None:
    lost = int(np.isnan(experiment.runs[0].output).sum())
    assert 8 <= lost <= 12
    for run in found.runs:
        assert run.samples == len(run.time) - lost
        assert np.isnan(run.measured).sum() == lost
        assert np.isfinite(run.after).all()
        assert run.average is not None
        assert (run.average.samples, len(run.average.reading)) == (run.samples, len(run.time))
        (other,) = run.others
        assert other.samples == len(run.time)


@pytest.mark.usefixtures("blank_pictures")
def test_page_record_and_table_have_every_output(found: Findings) -> None:
    record = findings_to_json(found)
    assert [one["name"] for one in record["other_outputs"]] == ["resistance"]
    (other,) = found.runs[-1].others
    assert record["runs"][-1]["other_outputs"]["resistance"]["rmse_after"] == other.rmse_after
    assert any(sentence.startswith("Error of the resistance: ") for sentence in narrate(found).summary)
    head = findings_runs(found).splitlines()[0]
    assert "resistance measured" in head
    page = findings_to_html(found)
    assert "The other outputs" in page
    assert "resistance: measured − model" in page
    assert found.extended_model is not None
    assert [output.name for output in found.extended_model.outputs] == ["strain", "resistance"]


def test_the_model_has_the_mean_of_the_runs_own_values(found: Findings) -> None:
    values = {one.name: one.value for one in found.after}
    own = [values[f"austenite_start[{run}]"] for run in ("low", "high")]
    assert found.extended_model is not None
    saved = found.extended_model.parameters["austenite_start"]
    assert saved.value == pytest.approx(np.mean(own))
    assert saved.standard_error == pytest.approx(np.std(own, ddof=1), rel=1e-5)


def test_misfits_of_every_output_count_in_noises_of_the_first(experiment: Experiment) -> None:
    """The sum of squares is that of `identify`, whose outputs count over their own noise."""
    fit = [run for run in experiment.runs if run.role == "fit"]
    theirs, ours = declared_problem(experiment, fit), job_of(experiment).problem
    ours = ours.with_system(theirs.system)
    point = theirs.start_values()
    assert ours.names == theirs.names
    assert sums_of_squares(ours, [point]) == pytest.approx(sums_of_squares(theirs, [point]))
    strain_noise = experiment.noise_sigma
    np.testing.assert_allclose(misfits(ours, [point])[0, 1::2], misfits(theirs, [point])[0, 1::2] * strain_noise / OHMS)


@pytest.mark.slow
def test_the_base_fit_is_that_of_identify(tmp_path: Path) -> None:
    experiment = bench(tmp_path, {}, own=True)
    found = close_loop(dataclasses.replace(experiment, priors=dataclasses.replace(experiment.priors, presets={})))
    theirs = {one.name: one.value for one in identify(experiment).estimates}
    ours = {one.name: one for one in found.before}
    for name, value in theirs.items():
        error = ours[name].standard_error
        assert error is None or ours[name].value == pytest.approx(value, abs=error)


@pytest.mark.slow
@pytest.mark.parametrize("only", ["", "resistance"])
def test_nothing_is_missing_in_two_outputs_or_in_the_other_alone(tmp_path: Path, only: str) -> None:
    found = close_loop(bench(tmp_path, {} if not only else HIDDEN, only=only))
    # The resistance does not show an expansion.
    assert found.verdict is Verdict.ADEQUATE
    assert found.output_name == (only or "strain")
