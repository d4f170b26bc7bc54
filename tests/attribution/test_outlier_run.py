"""A run that does not go with the others is named; where it is an effect of the library that shows in one run, that is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from smajax.attribution.close_loop import close_loop
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.report.narrative import narrate
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.rigs import show
from studies.attribution_benchmark.write import write


def _coupon(folder: Path, wrong: int) -> Experiment:
    """A coupon by the independent generator that lacks nothing, but for one fit run that another wire made."""
    true = write(next(case for case in cases() if case.name == "coupon-null-0-00"), folder)
    experiment = load_experiment(folder / "coupon-null-0-00" / "experiment.toml", CATALOGUE)
    other = dataclasses.replace(true.wire, martensite_start=true.wire.martensite_start + 4.0)
    shown = {run.name: show(true.rig, other, run, {}) for run in true.rig.runs(true.wire)}
    fit = [run.name for run in experiment.runs if run.role == "fit"]
    random = np.random.default_rng(wrong)

    def changed(name: str) -> np.ndarray:
        return np.asarray(shown[name] + random.normal(0.0, experiment.noise_sigma, shown[name].shape))

    runs = tuple(
        dataclasses.replace(run, outputs={experiment.output_name: changed(run.name)}) if run.name == fit[wrong] else run
        for run in experiment.runs
    )
    return dataclasses.replace(experiment, runs=runs)


# Alone in a coupon they account for some of it, and would be named.
TEMPTING = ("drifting_temperatures", "stress_dependent_width", "input_delay", "sensor_lag")


@pytest.mark.parametrize(("wrong", "tried"), [(2, TEMPTING), pytest.param(0, None, marks=pytest.mark.slow)])
def test_a_run_of_another_wire_is_named(wrong: int, tried: tuple[str, ...] | None, tmp_path: Path) -> None:
    experiment = dataclasses.replace(_coupon(tmp_path, wrong), effects_only=tried)
    name = [run.name for run in experiment.runs if run.role == "fit"][wrong]
    findings = close_loop(experiment)
    assert [one.run for one in findings.outlier_runs if one.residual_is_noise] == [name]
    assert findings.verdict == "not in the library"
    assert not any(effect.added for effect in findings.effects)
    assert "one run alone" in narrate(findings).summary[0]
    assert name in narrate(findings).summary[0]
