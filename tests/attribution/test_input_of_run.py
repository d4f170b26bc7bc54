"""An input that was recorded wrongly in one run is named with what it should have been, and none is where all are right."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.attribution import input_of_run, record_fits
from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import Findings
from smajax.attribution.input_of_run import FAR_LESS, corrected, record_errors
from smajax.attribution.job import job_of
from smajax.attribution.laplace_evidence import fitted_model
from smajax.attribution.leave_one_run_out import left_of_the_others
from smajax.attribution.model_fits import Model, Search, Start
from smajax.attribution.record_error import (
    FoundRecordErrors,
)
from smajax.attribution.record_fits import Beside
from smajax.core.parameters import parameter_values, parameters
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Run
from smajax.fit.base_model import base_model
from smajax.fit.experiment_problem import free_by_name, own_values
from smajax.fit.preset_priors import preset_priors
from smajax.report.narrative.record_errors import of_wrong_records, what_was_wrong
from tests.helpers.hot_weight import DT, SAMPLES, UNKNOWNS, hot_weight
from tests.helpers.made_findings import made_findings
from tests.helpers.wrong_records import FOUND, demo, early

NAMES = ("first", "second", "third", "fourth")


def _searched(
    truth: dict[str, float], wrong: Callable[[jax.Array], jax.Array], run: int | None
) -> tuple[Search, Model, Model, list[Run]]:
    """A base model and one with latent heat, fitted to runs of which the record of `run` is changed by `wrong`."""
    joint = hot_weight(truth, ("latent_heat",)).joint
    batch = joint.problem.batch
    volts = batch.inputs["voltage"]
    if run is not None:
        volts = volts.at[run].set(wrong(volts[run]))
    problem = dataclasses.replace(joint.problem, batch=dataclasses.replace(batch, inputs={"voltage": volts}))
    setting = Search(problem, UNKNOWNS, joint.bounds, ("latent_heat",), ResultCache())
    start = problem.start_values()
    models: list[Model] = []
    for effects in ((), ("latent_heat",)):
        (fit,), _ = setting.fit([Start(effects, start)], "a fit", settled=1e-3)
        models.append(Model(effects, fit.values, fit.cost, np.zeros(volts.shape), 0.0))
    time = np.asarray(DT * np.arange(SAMPLES), dtype=np.float64)
    runs = [
        Run(name, "fit", time, {"voltage": np.asarray(volts[k])}, {"position": problem.measured[k]}, {}, (), "")
        for k, name in enumerate(NAMES)
    ]
    base, extended = models
    return setting, base, extended, runs


@pytest.mark.parametrize(
    ("truth", "wrong", "run", "coefficient", "value"),
    [
        ({}, early, 0, "input_delay.delay", 0.6),
        ({}, lambda volts: volts / 1.05, 3, "input_level.gain", 0.05),  # the fit leaves more of every other run
        pytest.param(
            {"latent_heat.enthalpy": 1.2e4},
            lambda volts: volts / 0.9,
            2,
            "input_level.gain",
            -0.1,
            marks=pytest.mark.slow,
        ),
    ],
    ids=["recorded early", "noted too low", "noted too high beside a latent heat"],
)
def test_a_wrong_record_is_named_with_its_run_and_size(
    truth: dict[str, float], wrong: Callable[[jax.Array], jax.Array], run: int, coefficient: str, value: float
) -> None:
    setting, base, extended, runs = _searched(truth, wrong, run)
    asked = record_errors(setting, (base, extended), extended, runs)
    assert asked is not None
    (found,) = asked.errors
    assert (found.run, found.channel, found.coefficient) == (NAMES[run], "voltage", coefficient)
    assert found.value == pytest.approx(value, abs=max(4.0 * found.standard_error, 1e-3 * abs(value)))
    # Where nothing else is missing the latent heat was a stand-in; where it is, it stays beside the record's error.
    assert found.instead_of == (() if truth else ("latent_heat",))
    assert asked.beside == (("latent_heat",) if truth else ())


def test_where_every_record_is_right_none_is_named() -> None:
    setting, base, extended, runs = _searched({"latent_heat.enthalpy": 1.2e4}, early, None)
    assert record_errors(setting, (base, extended), extended, runs) is None
    assert record_errors(setting, (base,), base, runs[:2]) is None  # of two that disagree either may be wrong


def test_no_record_is_wrong_where_the_values_of_presets_are() -> None:
    """Beside an error of a record these are free: that error is zero then, and the model leaves noise all the same."""
    joint = hot_weight(
        {}, ("latent_heat",), factors={"stress_slope_austenite": 1.2, "stress_slope_martensite": 0.9}
    ).joint
    problem = joint.problem
    table, values = parameters(problem.system), parameter_values(problem.system)
    presets = preset_priors(table, values, frozenset())
    setting = Search(problem, UNKNOWNS, joint.bounds, ("latent_heat",), ResultCache(), presets=presets)
    (fit,), _ = setting.fit([Start((), problem.start_values())], "a fit", settled=1e-3)
    base = Model((), fit.values, fit.cost, np.zeros(problem.measured.shape), 0.0)
    noise = float(setting.problem.noise_sigma)
    assert fitted_model(setting.joint(()), (), fit.values, ()).rms > FAR_LESS * noise
    time = np.asarray(DT * np.arange(SAMPLES), dtype=np.float64)
    runs = [
        Run(name, "fit", time, {"voltage": np.asarray(problem.batch.inputs["voltage"][k])}, {}, {}, (), "")
        for k, name in enumerate(NAMES)
    ]
    assert record_errors(setting, (base,), base, runs) == FoundRecordErrors((), ())


@pytest.mark.slow
def test_no_record_is_wrong_where_more_is_missing() -> None:
    """A sensor whose zero drifts in all runs, which nothing that is looked at explains: the error of the record would take its part of it."""
    setting, base, extended, runs = _searched({}, early, 0)
    assert record_errors(setting, (base, extended), extended, runs) is not None
    drift = 20.0 * float(setting.problem.noise_sigma) * np.sin(np.linspace(0.0, 9.0, SAMPLES))
    problem = setting.problem.with_output(jnp.asarray(setting.problem.measured + drift))
    assert record_errors(dataclasses.replace(setting, problem=problem), (base, extended), extended, runs) is None


def test_before_a_search_has_ended_the_model_with_the_error_has_to_leave_far_less() -> None:
    setting, base, extended, runs = _searched({}, early, 0)
    assert record_errors(setting, (base, extended), extended, runs, FAR_LESS) is not None
    assert record_errors(setting, (base, extended), extended, runs, 1e3) is None


@pytest.mark.parametrize(
    ("present", "left", "explains"),
    [
        (2.0, 1.95, False),  # noises: as a load that is 0.4 % off, where the model leaves two of them
        (2.0, 1.2, True),
        (9.0, 1.9, True),
        (9.0, 2.1, False),
        (1.05, 1.0, True),  # several effects stand in for it
    ],
)
def test_when_a_search_has_ended_the_error_explains_most_of_what_is_left(
    monkeypatch: pytest.MonkeyPatch, present: float, left: float, explains: bool
) -> None:
    monkeypatch.setattr(input_of_run, "independent_error", lambda *_: 1.0)
    models = [
        SimpleNamespace(rms=rms, log_evidence=lambda _, odds=odds: odds) for rms, odds in ((present, 0.0), (left, 9.0))
    ]
    fit: Any = SimpleNamespace(model=models[1])
    compared = input_of_run._Compared(cast(Any, models[0]), 1.0, True, None, [fit])
    assert compared.explaining([fit]) == [fit] * explains


def test_without_a_run_whose_record_is_wrong_little_is_left_of_the_others() -> None:
    setting, base, _, runs = _searched({}, early, 0)
    joint = setting.joint(setting.candidates)
    noise = float(setting.problem.noise_sigma)
    model = fitted_model(joint, (), base.values, ())
    of_all, ((groups, before, after),) = left_of_the_others(joint, model, noise, ())
    assert of_all < model.rms
    assert groups == [(run,) for run in range(len(runs))]
    assert before.shape == after.shape == (len(runs),)
    assert after[0] < 0.3 * before[0]
    assert (after[1:] > 0.5 * before[1:]).all()


def test_a_corrected_run_has_the_value_and_all_others_have_none() -> None:
    experiment = corrected(demo(), FOUND)
    assert experiment.declared_effects == ("input_delay",)
    (effect,) = base_model(experiment).effects
    assert float(effect.delay) == 0.0
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    free = free_by_name(experiment, fit_runs)
    assert [name for name in free if name.startswith("input_delay")] == ["input_delay.delay[steps]"]
    own = own_values(experiment, fit_runs)
    assert own.single == ("input_delay.delay",)
    begins = dict(zip(own.runs, np.asarray(own.start)[:, own.names.index("input_delay.delay")].tolist(), strict=True))
    assert begins == {run.name: 0.8 if run.name == "steps" else 0.0 for run in fit_runs}


def test_two_runs_may_each_have_an_error_of_one_kind() -> None:
    experiment = corrected(corrected(demo(), FOUND), dataclasses.replace(FOUND, run="triangle", value=-0.3))
    assert experiment.declared_effects == ("input_delay",)
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    free = free_by_name(experiment, fit_runs)
    late = [name for name in free if name.startswith("input_delay")]
    assert sorted(late) == ["input_delay.delay[steps]", "input_delay.delay[triangle]"]
    own = own_values(experiment, fit_runs)
    assert (own.names.count("input_delay.delay"), own.single) == (1, ("input_delay.delay",))
    begins = dict(zip(own.runs, np.asarray(own.start)[:, own.names.index("input_delay.delay")].tolist(), strict=True))
    assert begins == {run.name: {"steps": 0.8, "triangle": -0.3}.get(run.name, 0.0) for run in fit_runs}


def test_an_error_of_a_kind_that_was_corrected_is_sought_in_the_other_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    job = job_of(corrected(demo(), FOUND))
    setting = Search(job.problem, job.unknowns, job.bounds, (), ResultCache())
    host = Model((), job.problem.start_values(), 1.0, np.zeros(job.problem.measured.shape), 1.0)
    names = [run.name for run in job.fit_runs]
    monkeypatch.setattr(record_fits, "misfits", lambda *_: [np.ones(job.problem.measured.shape)])  # nothing is fitted
    beside = Beside.of(setting, host, (), names)
    assert beside is not None
    late = {name for name in beside.possible if name.startswith("input_delay")}
    assert late == {f"input_delay.delay[{name}]" for name in names if name != "steps"}
    assert "input_delay.delay[steps]" in beside.joint.free(())  # it stays an unknown
    own = beside.joint.problem.per_run
    assert len(own.names) == len(set(own.names))
    begins = own.start[names.index("steps"), own.names.index("input_delay.delay")]
    assert float(begins) == 0.8


def test_what_was_wrong_with_one_run_is_nothing_that_other_runs_or_the_model_file_have() -> None:
    """Fit runs as they are, one of them late; a held-out run is simulated without, and so is a plant made of the saved model."""
    findings = _loop_with_a_late_run("input_delay")
    (found,) = findings.record_errors
    (own,) = [one for one in findings.before if one.name.startswith("input_delay")]
    assert own.name == "input_delay.delay[steps]"
    assert (found.value, found.standard_error) == (own.value, own.standard_error)
    assert findings.base_model is not None
    assert float(findings.base_model.values.get("input_delay.delay", 0.0)) == 0.0
    assert all("input_delay.delay" not in run.own_after for run in findings.runs)


def test_the_page_says_what_the_record_should_have_been() -> None:
    findings = dataclasses.replace(made_findings(), record_errors=(FOUND,))
    (said,) = of_wrong_records(findings)
    assert "the recorded voltage of steps is 0.8000 ± 0.0010 s early: what it shows acted so much later" in said
    assert "Without that the search names draught in its place." in said
    tried = dataclasses.replace(findings, record_errors=(dataclasses.replace(FOUND, on_trial=True),))
    (said,) = of_wrong_records(tried)  # of a search that was ended by the user
    assert said.startswith("An input of one run may not be right: the recorded voltage of steps")
    clock = dataclasses.replace(FOUND, coefficient="input_clock.rate", value=-0.01, standard_error=1e-3)
    assert what_was_wrong(clock).endswith("right at its start, and 0.600 ± 0.060 s late at its end")
    load = dataclasses.replace(FOUND, channel="mass", coefficient="wrong_load.share", value=-0.1, standard_error=2e-3)
    assert what_was_wrong(load) == "the recorded mass of steps should have been 0.9000 ± 0.0020 times what it is"


def _loop_with_a_late_run(*only: str) -> Findings:
    experiment = demo()
    late = round(0.8 / experiment.step)

    def wrong(run: Run) -> Run:
        volts = run.inputs["voltage"]
        early = np.concatenate([volts[late:], np.full(late, volts[-1])])
        return dataclasses.replace(run, inputs={**run.inputs, "voltage": early}) if run.name == "steps" else run

    runs = tuple(wrong(run) for run in experiment.runs)
    return close_loop(dataclasses.replace(experiment, runs=runs, effects_only=only))


@pytest.mark.slow  # a loop, made twice
def test_the_loop_goes_on_with_the_corrected_run() -> None:
    findings = _loop_with_a_late_run("latent_heat", "input_delay", "draught", "rising_convection")
    (found,) = findings.record_errors
    assert (found.run, found.coefficient) == ("steps", "input_delay.delay")
    assert found.value == pytest.approx(0.8, abs=4.0 * found.standard_error)
    assert findings.verdict == "adequate"
    assert all(run.rmse_after < 1.2 * findings.noise_sigma for run in findings.runs)
