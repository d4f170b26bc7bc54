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
from smajax.attribution.model_fits import Search
from smajax.attribution.run_extent import extent_of
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.experiment_problem import declared_problem
from smajax.fit.identify import identify
from smajax.fit.outputs_of_runs import misfits, sums_of_squares
from smajax.report.csv_files import findings_parameters, findings_runs
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
    (listed,) = [one for one in found.priors if one.name == "martensite_start"]
    assert (listed.base, listed.width, listed.of_unknown) == (54.0, 1.0, True)
    said = "The prior of martensite_start is 54 °C ± 1 K by the experiment file; without it martensite_start has its bounds alone."
    assert said in narrate(found).check


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
    assert "resistance moves" in head
    page = findings_to_html(found)
    assert "The other outputs" in page
    assert "resistance: measured − model" in page
    assert found.extended_model is not None
    assert [output.name for output in found.extended_model.outputs] == ["strain", "resistance"]


@pytest.mark.usefixtures("blank_pictures")
def test_the_own_value_of_a_held_out_run_stands_beside_those_of_the_fit_runs(found: Findings) -> None:
    held_out = found.runs[-1]
    assert all(not run.own_after for run in found.runs if run.role == "fit")
    value = held_out.own_after["austenite_start"]
    fitted = next(one for one in found.after if one.name == "austenite_start[low]")
    assert fitted.standard_error is not None
    assert value == pytest.approx(COUPON.wire.austenite_start + APART[-1], abs=4.0 * fitted.standard_error)
    name = f"austenite_start[{held_out.name}]"
    page = findings_to_html(found)
    low, high, other = (page.index(f"<td>austenite start[{run}]</td>") for run in ("low", "high", held_out.name))
    assert low < high < other
    assert "fitted to the held-out run alone, all else held" in page[other : page.index("</tr>", other)]
    assert findings_to_json(found)["runs"][-1]["values_of_run_after"] == held_out.own_after
    (row,) = [line.split(",") for line in findings_parameters(found).splitlines() if line.startswith(name)]
    assert float(row[4]) == pytest.approx(value)


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


def test_of_two_outputs_the_order_changes_nothing(experiment: Experiment) -> None:
    """What left-out errors explain is counted in noises of the first, whichever that is."""
    flipped = dataclasses.replace(
        experiment,
        outputs=experiment.outputs[::-1],
        runs=tuple(
            dataclasses.replace(run, outputs=dict(reversed(list(run.outputs.items())))) for run in experiment.runs
        ),
    )
    shares = []
    for one in (experiment, flipped):
        job = job_of(one)
        setting = Search(job.problem, job.unknowns, job.bounds, job.candidates, ResultCache(None))
        shares.append(setting.explained_variance(5.0 * one.noise_sigma))
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)
    assert 0.5 < shares[0] < 1.0


def test_an_output_that_leaves_less_than_its_noise_does_not_make_up_for_another(experiment: Experiment) -> None:
    job = job_of(experiment)
    setting = Search(job.problem, job.unknowns, job.bounds, job.candidates, ResultCache(None))
    mask = np.asarray(job.problem.batch.mask)
    slow = 1.4 * np.sqrt(2.0) * np.sin(np.arange(mask.shape[1]) / 20.0)
    noise = np.random.default_rng(1).normal(0.0, 0.3, mask.shape)
    misfit = np.where(np.arange(len(mask))[:, None] % 2 == 0, slow, noise) * experiment.noise_sigma * mask
    assert setting.noise_by_output(misfit, mask) == [False, True]
    assert not setting.all_noise(misfit, mask)


def test_a_run_is_as_long_as_its_last_sample_of_any_output(experiment: Experiment) -> None:
    whole = extent_of(job_of(experiment).problem).seconds
    rare = [np.where(np.arange(len(run.time)) % 10 == 0, run.output, np.nan) for run in experiment.runs]
    runs = tuple(
        dataclasses.replace(run, outputs={**run.outputs, "strain": strains})
        for run, strains in zip(experiment.runs, rare, strict=True)
    )
    assert extent_of(job_of(dataclasses.replace(experiment, runs=runs)).problem).seconds == whole
    none = dataclasses.replace(runs[0], outputs={**runs[0].outputs, "strain": np.full(len(rare[0]), np.nan)})
    assert extent_of(job_of(dataclasses.replace(experiment, runs=(none, *runs[1:]))).problem).seconds == whole


def test_the_band_of_a_held_out_run_is_no_wider_for_its_own_value(found: Findings) -> None:
    """Its own value follows the shared ones that it was fitted beside: on the first run and on the held-out one the band is as wide."""
    widths = [float(np.median(run.average.half_width)) for run in found.runs if run.average is not None]
    assert len(widths) == 3
    assert widths[2] < 1.5 * max(widths[:2])
    assert found.runs[2].average is not None
    assert found.runs[2].average.coverage > 0.8
