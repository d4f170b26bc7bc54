"""The models that `close-loop` ends with, as they are saved: base and extended, with all that is likely beside the latter."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from smajax.attribution.averaged_prediction import Averaged, likely_models, prediction_errors
from smajax.attribution.final_model_findings import ParametersFound
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.job import Job
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.core.names_of_runs import is_of_run, parameter_of
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import actuator_model, range_of, rounded
from smajax.data.model_file.record import LikelyModel, ModelOutput
from smajax.data.model_file.values_of_runs import OfRuns
from smajax.fit.packed_runs import simulate_batch, states_by_run
from smajax.model.channels import RANGED


def saved_model(
    job: Job,
    setting: Search,
    search: JointSearch,
    model: Model,
    found: ParametersFound,
    average: Averaged | None,
    states: Mapping[str, Mapping[str, np.ndarray]],
) -> ActuatorModel:
    """`model` with its parameters `found`, and with the likely models of `average`, where predictions are those of an average.

    states: temperature and stress of each fit run by it, (n,), by the run's name.
    """
    own = search.joint.ordered(model.effects)
    weighted = [(search.fitted[own], 1.0)]
    if average is not None:  # of one fit run nothing is averaged, and no model has been checked
        checked = [(search.fitted[one.effects], one.weight) for one in average.models]
        weighted = checked or likely_models(search, model)
    # The model itself first, whatever its weight.
    weighted = sorted(weighted, key=lambda one: one[0].effects != own)
    likely = [
        _likely(job, search, one, model.values if one.effects == own else one.values, weight)
        for one, weight in weighted
    ]
    fitted = {one.name: one.value for one in found.parameters}
    scatter = {name: variance**0.5 for name, variance in OfRuns.among(fitted).scatter.items()}
    # Of one run none could be left out.
    missed = prediction_errors(setting, model) if len(job.fit_runs) > 1 else [None] * len(job.experiment.outputs)
    return actuator_model(
        job.experiment,
        likely,
        {parameter_of(name): bounds for name, bounds in job.bounds.items()},
        {**{one.name: one.standard_error for one in found.parameters}, **scatter},
        [
            ModelOutput(
                output.name,
                output.unit,
                output.noise_sigma,
                output.offset,
                None if error is None else rounded(error),
                None if output.reading_sigma is None else rounded(output.reading_sigma),
            )
            for output, error in zip(job.experiment.outputs, missed, strict=True)
        ],
        range_of((run, states[run.name]) for run in job.fit_runs),
    )


def fit_run_states(job: Job, setting: Search, model: Model) -> dict[str, dict[str, np.ndarray]]:
    """Temperature and stress of each fit run by `model`, (n,), by the run's name."""
    problem, index = setting.restricted(model.effects)
    values = model.values[index]
    found = simulate_batch(problem.system_at(jnp.asarray(values)), problem.with_own_values(values))
    return states_by_run(found, job.fit_runs, RANGED)


def _likely(job: Job, search: JointSearch, model: FittedModel, values: np.ndarray, weight: float) -> LikelyModel:
    at = dict(zip(search.joint.problem.names, np.asarray(values).tolist(), strict=True))
    covariance = model.covariance(search.error(model) ** 2) * np.outer(model.scales, model.scales)
    declared = job.experiment.declared_effects
    priors = dataclasses.replace(search.joint, width_factors=model.width_factors).prior_records(model.effects)
    single = job.problem.per_run.single  # errors of single runs' records: nothing that another run has
    of_runs = OfRuns.among({name: at[name] for name in model.names if parameter_of(name) not in single})
    names, whole = of_runs.beside(model.names, covariance)
    shared = [name for name in model.names if not is_of_run(name)]
    return LikelyModel(
        tuple(dict.fromkeys((*declared, *model.effects))),
        weight,
        {**{name: at[name] for name in shared}, **of_runs.means},
        names,
        whole,
        {name: priors[name] for name in shared if name in priors},
    )
