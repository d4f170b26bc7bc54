"""Noise, gaps and repeated times of an experiment's signals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from smajax.data.experiment.errors import ExperimentError
from tests.helpers.bench_experiment import changed, load, rewrite, write_run


def test_a_given_noise_shrinks_with_the_average_over_a_step(bench: Path) -> None:
    got = load(bench)
    at_rest = np.concatenate([run.output[1:20] for run in got.runs])
    assert got.noise_sigma == pytest.approx(1e-5 * 0.466, rel=0.01)
    assert got.outputs[0].reading_sigma == 1e-5
    assert np.std(at_rest) == pytest.approx(got.noise_sigma, rel=0.35)
    assert "given as 0.01 mm" in got.noise_how


def test_an_estimated_noise_is_that_of_the_resampled_output(bench: Path) -> None:
    got = load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'))
    assert got.noise_sigma == pytest.approx(1e-5 * 0.466, rel=0.25)
    assert got.outputs[0].reading_sigma == pytest.approx(1e-5, rel=0.25)
    assert got.noise_how.startswith("estimated from 1 fit run")


@pytest.mark.parametrize("step", ["12.5 ms", "20 ms", "25 ms"])
def test_an_estimated_noise_is_not_too_small_where_windows_share_samples(bench: Path, step: str) -> None:
    write_run(bench / "a.csv", count=6000)
    changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"')
    got = load(changed(bench, '"50 ms"', f'"{step}"'))
    at_rest = next(run for run in got.runs if run.name == "A")
    drift = 2e-6 * np.maximum(at_rest.time - 1.0, 0.0) * 1000.0
    found = np.std((at_rest.output - drift)[at_rest.time > 2.0])
    assert got.noise_sigma == pytest.approx(found, rel=0.06)


def test_missing_samples_and_gaps_in_time_are_left_out(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    lines[100:140] = [line.rsplit(",", 1)[0] + "," for line in lines[100:140]]
    (bench / "a.csv").write_text("\n".join(lines[:200] + lines[300:]) + "\n")
    words = r"the cell is empty; expected a number in every line; or write missing = 'skip'"
    with pytest.raises(ExperimentError, match=words):
        load(bench)
    got = load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"\nmissing = "skip"'))
    run = got.runs[0]
    away = np.isnan(run.output)
    # 1 s to 1.4 s in the cells, 2 s to 3 s in the time.
    assert away[(run.time > 1.03) & (run.time < 1.35)].all()
    assert away[(run.time > 2.05) & (run.time < 2.95)].all()
    assert not away[(run.time < 0.95) | ((run.time > 1.45) & (run.time < 1.9)) | (run.time > 3.05)].any()
    assert np.isfinite(run.inputs["duty"]).all()
    assert got.noise_sigma == pytest.approx(1e-5 * 0.466, rel=0.3)
    assert not any("gap" in one for one in got.warnings if "'position'" in one)


def test_repeated_times_are_merged_or_refused(bench: Path) -> None:
    lines = (bench / "a.csv").read_text().splitlines()
    (bench / "a.csv").write_text("\n".join([*lines, lines[-1]]) + "\n")
    told = [one for one in load(bench).warnings if "taken out" in one]  # one row of a log: one sentence
    assert told == ["run 'A': 1 sample of 'duty' and 'position' at a time that another one has was taken out"]
    with (bench / "a.csv").open("a") as file:
        file.write("4990,0,0\n")
    with pytest.raises(ExperimentError, match=r"does not increase.*or write repeated = 'mean'"):
        load(bench)
    text = (bench / "experiment.toml").read_text()
    (bench / "experiment.toml").write_text(text.replace('unit = "ms"', 'unit = "ms"\nrepeated = "last"', 1))
    assert load(bench).runs[0].time.shape == (100,)


def test_a_noise_that_cannot_be_estimated_has_to_be_given(bench: Path) -> None:
    rewrite(bench / "a.csv", position=np.zeros(500))
    with pytest.raises(ExperimentError, match=r"channels.position.noise: no noise can be seen"):
        load(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'))


def test_too_few_samples_for_the_noise_name_the_run_and_the_step(bench: Path) -> None:
    changed(changed(bench, 'noise = "0.01 mm"', 'noise = "estimate"'), '"50 ms"', '"1 s"')
    words = r"channels.position.noise: run 'A' has 5 samples at a step of 1 s, .*; take a shorter step or a longer run"
    with pytest.raises(ExperimentError, match=words):
        load(bench)
    write_run(bench / "a.csv", count=6)
    with pytest.raises(ExperimentError, match=r"run 'A' has 6 samples in its file, .*; take a longer run"):
        load(changed(bench, '"1 s"', '"5 ms"'))
