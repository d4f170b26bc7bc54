"""What the experiment file does not give is not known: the loop corrects such values instead of naming effects for them."""

from __future__ import annotations

import dataclasses
from importlib import resources

import numpy as np
import pytest

from smajax.attribution.close_loop import close_loop
from smajax.attribution.findings import Findings, Verdict
from smajax.core.parameters import get_parameters, parameter_values, set_parameters
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE
from smajax.fit.base_model import base_model
from smajax.fit.packed_runs import pack, simulate_batch
from smajax.fit.preset_priors import RELATIVE
from smajax.simulation.steppers import Integration

NOISE = 1e-4  # m
NAME, WRONG = "young_modulus_martensite", 1.6


def _bench(name: str = NAME, share: float = WRONG) -> tuple[Experiment, float]:
    """Runs of the demo's bench by a wire of which one value is `share` times the preset's, which the file does not give; (experiment, that value)."""
    with resources.as_file(resources.files("smajax") / "data" / "demo" / "complete") as folder:
        experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    known = {name: value for name, value in experiment.parameters.items() if name not in RELATIVE}
    experiment = dataclasses.replace(experiment, parameters=known)
    model = base_model(experiment)
    true = share * float(get_parameters(model, [name])[0])
    batch = pack(experiment.runs, experiment.step, parameter_values(model), Integration(1e-4))
    readings = np.asarray(simulate_batch(set_parameters(model, {name: true}), batch).reading)
    random = np.random.default_rng(11)
    runs = tuple(
        dataclasses.replace(
            run, outputs={run_output: readings[k, : len(run.time)] + NOISE * random.standard_normal(len(run.time))}
        )
        for k, run in enumerate(experiment.runs)
        for run_output in run.outputs
    )
    few = ("latent_heat", "thermal_expansion", "sensor_gain", "stress_dependent_strain")
    return dataclasses.replace(experiment, runs=runs, effects_only=few, effects_excluded=()), true


@pytest.fixture(scope="module")
def found() -> tuple[Findings, float]:
    experiment, true = _bench()
    return close_loop(experiment), true


@pytest.mark.slow
def test_no_effect_is_named_for_a_preset_that_is_wrong(found: tuple[Findings, float]) -> None:
    findings, _ = found
    assert findings.added == ()
    assert findings.verdict is Verdict.ADEQUATE


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("thermal_modulus", -1.0), ("damping", 0.05)])
def test_no_effect_is_named_for_a_thermal_modulus_of_the_other_sign_or_a_damping_of_a_twentieth(
    name: str, share: float
) -> None:
    experiment, true = _bench(name, share)
    findings = close_loop(dataclasses.replace(experiment, effects_only=()))
    assert findings.added == ()
    (found,) = [one for one in findings.after if one.name == name]
    assert found.standard_error is not None
    assert found.value == pytest.approx(true, abs=4.0 * found.standard_error)


@pytest.mark.slow
def test_the_value_that_was_not_given_comes_out_with_its_standard_error(found: tuple[Findings, float]) -> None:
    findings, true = found
    (modulus,) = [one for one in findings.after if one.name == NAME]
    assert modulus.start == pytest.approx(true / WRONG)
    assert modulus.standard_error is not None
    assert modulus.value == pytest.approx(true, abs=3.0 * modulus.standard_error)
    assert abs(modulus.value - modulus.start) > 3.0 * modulus.standard_error
    assert modulus.prior_base == pytest.approx(modulus.start)
    assert modulus.prior_deviation == pytest.approx(np.log(modulus.value / modulus.start) / RELATIVE[NAME][0])


@pytest.mark.slow
def test_the_saved_model_has_the_models_that_predictions_are_averaged_over(found: tuple[Findings, float]) -> None:
    findings, _ = found
    assert findings.extended_model is not None
    saved = {one.effects: one.probability for one in findings.extended_model.likely}
    assert saved == {one.effects: one.weight for one in findings.averaged}


@pytest.mark.slow  # another loop
def test_values_that_the_file_gives_are_held_and_an_effect_stands_in_for_the_wrong_one() -> None:
    experiment, _ = _bench()
    values = parameter_values(base_model(experiment))
    given = {**{name: values[name] for name in RELATIVE if name in values}, **experiment.parameters}
    findings = close_loop(dataclasses.replace(experiment, parameters=given))
    assert not set(RELATIVE) & {one.name for one in findings.after}
    assert findings.verdict is not Verdict.ADEQUATE
