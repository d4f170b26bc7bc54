"""A run that does not go with the others is named; where it is an effect of the library that shows in one run, that is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution.close_loop import close_loop
from smajax.attribution.model_fits import Model, Search, Start
from smajax.attribution.outlier_run import outlier_runs
from smajax.core.parameters import parameter_values, parameters
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.preset_priors import preset_bounds, preset_priors
from smajax.fit.problem import Problem
from smajax.report.narrative import narrate
from studies.attribution_benchmark.cases import cases
from studies.attribution_benchmark.rigs import show
from studies.attribution_benchmark.write import write
from tests.helpers.hot_weight import NOISE, UNKNOWNS, hot_weight


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


@pytest.mark.parametrize(
    ("wrong", "tried"),
    [pytest.param(wrong, tried, marks=pytest.mark.slow) for wrong, tried in ((2, TEMPTING), (0, None))],
)
def test_a_run_of_another_wire_is_named(wrong: int, tried: tuple[str, ...] | None, tmp_path: Path) -> None:
    experiment = dataclasses.replace(_coupon(tmp_path, wrong), effects_only=tried)
    name = [run.name for run in experiment.runs if run.role == "fit"][wrong]
    findings = close_loop(experiment)
    assert [one.run for one in findings.outlier_runs if one.residual_is_noise] == [name]
    assert findings.verdict == "not in the library"
    assert not any(effect.added for effect in findings.effects)
    assert "one run alone" in narrate(findings).summary[0]
    assert name in narrate(findings).summary[0]


def test_a_run_that_drew_the_values_of_presets_is_found_with_these_free() -> None:
    """Martensite less stiff than the preset's in all runs, and one run by another wire: fitted to all, the modulus is that of neither."""
    right, wrong = ({"young_modulus_martensite": 0.7, **more} for more in ({}, {"martensite_start": 1.1}))
    runs = [hot_weight({}, factors=factors).joint.problem.batch for factors in (right, wrong)]
    mixed = np.array(runs[0].output)
    mixed[2] = np.asarray(runs[1].output)[2]
    search = hot_weight({}).joint
    batch = dataclasses.replace(runs[0], output=jnp.asarray(mixed))
    problem = Problem.build(search.problem.system, batch, NOISE, False)
    table, values = parameters(problem.system), parameter_values(problem.system)
    presets = {"young_modulus_martensite": preset_priors(table, values, frozenset())["young_modulus_martensite"]}
    bounds = {**search.bounds, **preset_bounds(presets, search.bounds)}
    setting = Search(problem, UNKNOWNS, bounds, (), ResultCache(), presets=presets)
    (fit,), _ = setting.fit([Start((), problem.start_values())], "a fit to all runs", presets=True)
    model = Model((), fit.values, fit.cost, np.zeros(mixed.shape), 0.0)
    names = ["first", "second", "of another wire", "fourth"]
    found = outlier_runs(setting, model, names)
    assert [one.run for one in found if one.residual_is_noise] == ["of another wire"]
    held = outlier_runs(dataclasses.replace(setting, presets={}), model, names)
    assert not [one for one in held if one.residual_is_noise]
