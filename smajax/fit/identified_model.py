"""The model that an identification ends with, as it is saved."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from smajax.data.experiment.record import RUN_STARTS
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import actuator_model, range_of, rounded
from smajax.data.model_file.record import LikelyModel, ModelOutput
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
    shared = {name: value for name, value in fitted.values.items() if "[" not in name}
    of_runs: dict[str, list[float]] = {}
    for name, value in fitted.values.items():
        if "[" in name:
            own = name.split("[")[0]
            of_runs.setdefault(RUN_STARTS.get(own, own), []).append(value)
    means = {name: float(np.mean(values)) for name, values in of_runs.items() if name}
    # Another run has another value: what they scatter by is the error of the mean as a prediction of it.
    scatter = {name: float(np.var(of_runs[name], ddof=1)) for name in means if len(of_runs[name]) > 1}
    keep = [k for k, name in enumerate(statistics.correlated) if name in shared]
    names = (*(statistics.correlated[k] for k in keep), *scatter)
    covariance = np.zeros((len(names), len(names)))
    covariance[: len(keep), : len(keep)] = statistics.covariance[np.ix_(keep, keep)]
    covariance[range(len(keep), len(names)), range(len(keep), len(names))] = list(scatter.values())
    likely = LikelyModel(
        experiment.declared_effects,
        1.0,
        {**shared, **means},
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
        {name.split("[")[0]: one for name, one in setup.bounds.items()},
        {**statistics.uncertainty.standard_error, **{name: variance**0.5 for name, variance in scatter.items()}},
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
        result.append(ModelOutput(output.name, output.unit, rounded(sigma), output.offset, missed))
    return result
