"""The model that an identification ends with, as it is saved."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from smajax.data.experiment.record import RUN_STARTS
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import actuator_model, range_of, rounded
from smajax.data.model_file.record import LikelyModel, ModelOutput
from smajax.fit.identify_stages import Fitted, Setup, Statistics
from smajax.fit.packed_runs import simulate_batch

BAND = 0.9
STATES = ("temperature", "stress")


def identified_model(setup: Setup, fitted: Fitted, statistics: Statistics) -> ActuatorModel:
    """With the covariance of what the runs determine. Of a parameter with a value of each run's own it has the fit runs' mean."""
    experiment = setup.experiment
    shared = {name: value for name, value in fitted.values.items() if "[" not in name}
    of_runs: dict[str, list[float]] = {}
    for name, value in fitted.values.items():
        if "[" in name:
            own = name.split("[")[0]
            of_runs.setdefault(RUN_STARTS.get(own, own), []).append(value)
    means = {name: float(np.mean(values)) for name, values in of_runs.items() if name}
    keep = [k for k, name in enumerate(statistics.correlated) if name in shared]
    names = tuple(statistics.correlated[k] for k in keep)
    likely = LikelyModel(
        experiment.declared_effects,
        1.0,
        {**shared, **means},
        names,
        statistics.covariance[np.ix_(keep, keep)],
        {name: one.prior for name, one in setup.unknowns.items() if name in shared and one.prior is not None},
    )
    problem = fitted.problem
    system = problem.system_at(jnp.asarray(fitted.best.values))
    states = simulate_batch(system, problem.batch)
    ranges = range_of(
        (run, {name: np.asarray(getattr(states, name))[number, : len(run.time)] for name in STATES})
        for number, run in enumerate(setup.fit_runs)
    )
    return actuator_model(
        experiment,
        [likely],
        {name.split("[")[0]: one for name, one in setup.bounds.items()},
        statistics.uncertainty.standard_error,
        _outputs(setup, fitted, statistics),
        ranges,
    )


def _outputs(setup: Setup, fitted: Fitted, statistics: Statistics) -> list[ModelOutput]:
    """Every sensor; nine of ten samples of the fit runs' own residual stay within its prediction error."""
    outputs = setup.experiment.outputs
    result = []
    for k, output in enumerate(outputs):
        sigma = float(fitted.problem.noise[k, 0])
        rows = slice(k, None, len(outputs))
        error = np.abs(statistics.misfit[rows][statistics.at.mask[rows] > 0]) * sigma
        result.append(
            ModelOutput(
                output.name, output.unit, rounded(sigma), output.offset, rounded(float(np.quantile(error, BAND)))
            )
        )
    return result
