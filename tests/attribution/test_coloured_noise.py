"""Noise with a memory, and held-out runs that do not bear out what was found: no effect is named for either."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from smajax.attribution.close_loop import close_loop
from smajax.attribution.reasons import HeldOutWorse
from smajax.core.parameters import parameter_values
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.data.readers.noise import estimate_noise
from smajax.fit.base_model import base_model
from smajax.fit.preset_priors import RELATIVE
from smajax.report.narrative import narrate
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.rigs import show
from studies.attribution_benchmark.write import write

MEMORY = 0.8  # from one sample to the next
LACKING, WEAK = "coupon-thermal_expansion-10-02", "coupon-thermal_expansion-1-00"
FEW = ("thermal_expansion", "creep", "sensor_drift")


def _coupon(
    folder: Path, seed: int, trend: float = 0.0, memory: float = MEMORY, name: str = "coupon-null-0-00"
) -> Experiment:
    """A coupon by the independent generator, with AR(1) noise. `trend`: of the fit runs' readings over a run, in noises."""
    true = write(next(case for case in cases() if case.name == name), folder)
    experiment = load_experiment(folder / name / "experiment.toml", CATALOGUE)
    random, sigma = np.random.default_rng(seed), experiment.noise_sigma
    shown = {run.name: show(true.rig, true.wire, run, true.effects) for run in true.rig.runs(true.wire)}
    runs = []
    for run in experiment.runs:
        drawn = random.normal(size=run.output.size + 200)
        slow = sigma * np.sqrt(1.0 - memory**2) * lfilter([1.0], [1.0, -memory], drawn)[200:]
        if run.role == "fit":
            slow += trend * sigma * np.linspace(-0.5, 0.5, slow.size)
        else:
            slow -= trend * sigma * np.linspace(-0.5, 0.5, slow.size)
        runs.append(dataclasses.replace(run, outputs={experiment.output_name: shown[run.name] + slow}))
    return dataclasses.replace(experiment, runs=tuple(runs))


def _estimated(experiment: Experiment) -> Experiment:
    """The same where nobody gave the noise: neighbouring samples, of which a noise with a memory shows too little."""
    fit = [run.output for run in experiment.runs if run.role == "fit"]
    sigma = float(np.median([estimate_noise(output, 0.0) for output in fit]))
    (output,) = experiment.outputs
    return dataclasses.replace(
        experiment, outputs=(dataclasses.replace(output, noise_sigma=sigma, noise_given=False, noise_how="estimated"),)
    )


@pytest.mark.parametrize("seed", [pytest.param(seed, marks=pytest.mark.slow) for seed in (0, 1)])
def test_autocorrelated_noise_leads_to_no_effect(seed: int, tmp_path: Path) -> None:
    findings = close_loop(_coupon(tmp_path, seed))
    assert not any(effect.added for effect in findings.effects)
    assert not any(term.named for term in findings.unknown)


@pytest.mark.slow  # a loop
@pytest.mark.parametrize("memory", [0.6, 0.9])
def test_undeclared_autocorrelated_noise_is_recognised_as_noise(memory: float, tmp_path: Path) -> None:
    findings = close_loop(_estimated(_coupon(tmp_path, 0, memory=memory)))
    assert findings.residual_after.ratio > 1.5
    assert findings.verdict == "adequate"
    assert findings.residual_after.filter_coefficient == pytest.approx(memory, abs=0.05)
    assert any("first-order autoregressive noise" in line for line in narrate(findings).summary)


@pytest.mark.slow  # a loop with one effect to find
def test_a_missing_effect_is_found_beside_undeclared_autocorrelated_noise(tmp_path: Path) -> None:
    findings = close_loop(_estimated(_coupon(tmp_path, 0, memory=0.6, name=LACKING)))
    assert [effect.name for effect in findings.effects if effect.added] == ["thermal_expansion"]
    assert findings.verdict == "explained"
    assert findings.residual_before.filter_coefficient == 0.0


def _thinned(experiment: Experiment, by: int) -> Experiment:
    """Every so manieth sample."""

    def every(series: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {name: values[::by] for name, values in series.items()}

    runs = [
        dataclasses.replace(run, time=run.time[::by], inputs=every(run.inputs), outputs=every(run.outputs))
        for run in experiment.runs
    ]
    return dataclasses.replace(experiment, step=by * experiment.step, runs=tuple(runs))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_an_effect_that_a_short_log_confuses_with_slow_noise_is_still_tested(seed: int, tmp_path: Path) -> None:
    whole = _coupon(tmp_path, seed, memory=0.5, name=WEAK)
    # The wire's values are given: an effect this weak is no larger than what a preset leaves open.
    values = parameter_values(base_model(whole))
    given = {
        name: values[name] for name in RELATIVE if name in values and name not in {one.name for one in whole.unknowns}
    }
    short = dataclasses.replace(
        _estimated(_thinned(whole, 4)), effects_only=FEW, parameters={**whole.parameters, **given}
    )
    findings = close_loop(short)
    assert [effect.name for effect in findings.effects if effect.added] == ["thermal_expansion"]


@pytest.mark.slow
def test_an_effect_that_the_held_out_runs_reject_is_not_named(tmp_path: Path) -> None:
    """All fit runs drift upwards and the held-out ones downwards: a drift that is found is no property of the bench."""
    findings = close_loop(_coupon(tmp_path, 0, trend=12.0))
    assert not any(effect.added for effect in findings.effects)
    assert findings.verdict == "not in the library"
    assert any(isinstance(entry.reason, HeldOutWorse) for entry in findings.rounds)
    assert findings.rejected
    assert all(one.rmse_with > one.rmse_without for one in findings.rejected)
    assert "not confirmed" in narrate(findings).summary[0]
    held_out = [run for run in findings.runs if run.role == "held-out"]
    assert all(run.rmse_after == run.rmse_before for run in held_out)


@pytest.mark.slow  # half a minute; the rejection alone is tested above
def test_a_right_effect_is_kept_when_the_wrong_one_beside_it_is_rejected(tmp_path: Path) -> None:
    """The same drift beside an effect that is there: the held-out runs reject the drift, and what the search then puts in its place."""
    findings = close_loop(_coupon(tmp_path, 0, trend=20.0, name=LACKING))
    assert [effect.name for effect in findings.effects if effect.added] == ["thermal_expansion"]
    first, again = findings.rejected
    assert first.effects == ("sensor_drift",)
    assert again.effects
    assert not {"thermal_expansion", "sensor_drift"} & set(again.effects)
    assert any(line.startswith("Sensor drift would lower the error") for line in narrate(findings).summary)
    assert findings.verdict == "partly explained"
