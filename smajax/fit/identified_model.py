"""The model that an identification ends with, as it is saved."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from smajax.core.names_of_runs import is_of_run, parameter_of
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import actuator_model, range_of, rounded
from smajax.data.model_file.record import LikelyModel, ModelOutput
from smajax.data.model_file.values_of_runs import OfRuns
from smajax.fit.identify_result import IdentifiedRun
from smajax.fit.identify_stages import Fitted, Setup, Statistics
from smajax.fit.packed_runs import simulate_batch, states_by_run
from smajax.fit.prediction_band import BAND
from smajax.model.channels import RANGED


def identified_model(
    setup: Setup, fitted: Fitted, statistics: Statistics, runs: Sequence[IdentifiedRun]
) -> ActuatorModel:
    """With the covariance of what the runs determine. Of a parameter with a value of each run's own it has the fit runs' mean, and
    what these values scatter by as its error.
    """
    experiment = setup.experiment
    shared = {name: value for name, value in fitted.values.items() if not is_of_run(name)}
    of_runs = OfRuns.among(fitted.values)
    names, covariance = of_runs.beside(statistics.correlated, statistics.covariance)
    likely = LikelyModel(
        experiment.declared_effects,
        1.0,
        {**shared, **of_runs.means},
        names,
        covariance,
        {name: one.prior for name, one in setup.unknowns.items() if name in shared and one.prior is not None},
    )
    problem = fitted.problem
    system = problem.system_at(jnp.asarray(fitted.best.values))
    states = states_by_run(simulate_batch(system, problem.batch), setup.fit_runs, RANGED)
    ranges = range_of((run, states[run.name]) for run in setup.fit_runs)
    return actuator_model(
        experiment,
        [likely],
        {parameter_of(name): one for name, one in setup.bounds.items()},
        {
            **statistics.uncertainty.standard_error,
            **{name: variance**0.5 for name, variance in of_runs.scatter.items()},
        },
        _outputs(setup, fitted, runs),
        ranges,
    )


def _outputs(setup: Setup, fitted: Fitted, runs: Sequence[IdentifiedRun]) -> list[ModelOutput]:
    """Every sensor; nine of ten samples of the held-out runs stay within its prediction error. Without such runs it has none."""
    result = []
    for k, output in enumerate(setup.experiment.outputs):
        errors = [run.series[k].measured - run.series[k].simulated for run in runs if run.role != "fit"]
        error = np.abs(np.concatenate(errors)) if errors else np.zeros(0)
        error = error[np.isfinite(error)]
        missed = rounded(float(np.quantile(error, BAND))) if error.size else None
        sigma = float(fitted.problem.noise[k, 0])
        # A noise that was fitted holds what the model lacks too.
        single = output.reading_sigma or (output.noise_sigma if fitted.noise_estimated[k] else None)
        result.append(
            ModelOutput(output.name, output.unit, rounded(sigma), output.offset, missed, single and rounded(single))
        )
    return result
