"""A kept model against runs: what it predicts, with a band, and where a run lies outside of what it was fitted to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from smajax.core.parameters import parameter_values
from smajax.core.runtime import require_float64
from smajax.data.experiment.errors import ExperimentError
from smajax.data.experiment.record import Experiment, Output, Run
from smajax.data.experiment.toml_file import Quantity
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.of_experiment import quantities
from smajax.data.model_file.read_logs import read_logs
from smajax.data.model_file.record import LikelyModel, ModelOutput, range_unit
from smajax.data.model_file.runs_of_model import runs_of_model
from smajax.data.open_experiment import open_experiment
from smajax.fit.integration import (
    choose_integration,
    integration_error,
    unlimited,
    with_integration,
)
from smajax.fit.packed_runs import pack, simulate_batch, states_by_run
from smajax.fit.prediction import Extrapolation as Extrapolation
from smajax.fit.prediction import PredictedRun as PredictedRun
from smajax.fit.prediction import PredictedSeries as PredictedSeries
from smajax.fit.prediction import Prediction as Prediction
from smajax.fit.prediction_band import BAND as BAND
from smajax.fit.prediction_band import NORMAL, averaged_band, in_band, moving, reading_of
from smajax.fit.problem import Problem
from smajax.model.channels import SHOWN

BEYOND = 0.02  # of a fitted range: by less a run does not leave it
FEW = 0.005  # of the samples: a single one of a rate is a jump of an input


def predict(  # keywords, which a caller names one by one
    model: ActuatorModel,
    runs: Experiment | str | Path | Sequence[str | Path],
    *,
    inputs: Mapping[str, Quantity] | None = None,
    parameters: Mapping[str, Quantity] | None = None,
    decimal: str = "",
) -> Prediction:
    """`runs` as `model` predicts them: nothing is fitted, and the roles of an experiment mean nothing.

    runs: an experiment, the path of an experiment file or of a log, or paths of logs. inputs: constants that no log has, as
    `{"mass": "0.2 kg"}`; parameters: values that replace the model's in these runs; decimal: the decimal mark; all three of logs only.
    An output that has an offset in the model has each run's own, the mean of its residual. Raises ValueError in float32, and
    ExperimentError for what cannot be read or is of another load.
    """
    require_float64("predict")
    if isinstance(runs, Experiment):
        return _prediction(model, runs)
    paths = [Path(runs)] if isinstance(runs, str | Path) else [Path(one) for one in runs]
    tables = [path for path in paths if path.suffix == ".toml" or path.is_dir()]
    if not tables:
        experiment, messages = read_logs(model, paths, inputs, parameters, decimal)
        found = _prediction(model, experiment)
        return replace(found, warnings=(*messages, *found.warnings))
    if len(paths) > 1:
        raise ExperimentError(tables[0], "", "is an experiment file beside other files; give it alone, or logs alone")
    if inputs or parameters or decimal:
        raise ExperimentError(tables[0], "", "says inputs, parameters and the decimal mark itself; give them there")
    return _prediction(model, open_experiment(tables[0]))


def _prediction(model: ActuatorModel, experiment: Experiment) -> Prediction:
    experiment, notes = runs_of_model(model, experiment)
    known = {one.name: one for one in model.outputs}
    likely, weights = model.weighted
    noise, offset, missed = _of_outputs(model, experiment)
    problems = [_problem(model, one, experiment, noise, offset) for one in likely]
    integration = unlimited(choose_integration(problems[0], problems[0].system))
    problems = [with_integration(one, integration) for one in problems]
    predicted = [
        reading_of(problem, problem.start_values(), one.names, one.deviations, one.correlation)
        for problem, one in zip(problems, likely, strict=True)
    ]
    readings, variances = (np.stack([getattr(one, name) for one in predicted]) for name in ("reading", "variance"))
    mean, half = averaged_band(readings, variances, weights, missed)
    # That of the reading, which each model has its own offset in.
    zero = np.tensordot(weights, np.stack([one.offset for one in predicted]), 1)
    states = states_by_run(simulate_batch(problems[0].system, problems[0].batch), experiment.runs, SHOWN)
    runs = []
    for number, run in enumerate(experiment.runs):
        n = len(run.time)
        rows = range(number * len(experiment.outputs), (number + 1) * len(experiment.outputs))
        series = tuple(
            _series(output, run, (mean[row, :n], half[row, :n]), known.get(output.name), zero[row])
            for row, output in zip(rows, experiment.outputs, strict=True)
        )
        own = states[run.name]
        fitted = any(one.role == "fit" and one.sha256 == run.sha256 for one in model.runs)
        beyond = extrapolations(model, run, own)
        runs.append(PredictedRun(run.name, run.time, run.inputs, series, own, beyond, run.sha256, fitted))
    error = integration_error(problems[0], problems[0].system)
    return Prediction(model, tuple(runs), experiment.step, error, (*model.warnings, *notes, *experiment.warnings))


def extrapolations(model: ActuatorModel, run: Run, states: Mapping[str, np.ndarray]) -> tuple[Extrapolation, ...]:
    """Inputs, temperature, its rate, stress and own parameters of a run that leave what the model was fitted to, and when."""
    found = []
    constant = {name: np.full(len(run.time), value) for name, value in run.parameters.items()}
    for name, series in {**constant, **quantities(run.time, run.inputs, states)}.items():
        fitted = model.fitted_range.get(name)
        if fitted is None and name in constant and name in model.values and model.runs:
            fitted = (model.values[name],) * 2  # the same in all runs of the fit
        if fitted is None:
            continue
        low, high = fitted
        slack = BEYOND * (high - low) + 1e-5 * max(abs(low), abs(high))
        outside = (series < low - slack) | (series > high + slack)
        if outside.mean() > FEW:
            edges = np.flatnonzero(np.diff(np.concatenate([[False], outside, [False]]).astype(int)))
            spans = tuple((float(run.time[a]), float(run.time[b - 1])) for a, b in edges.reshape(-1, 2))
            reached = float(series.min()), float(series.max())
            share = float(outside.mean())
            found.append(Extrapolation(name, range_unit(name, model.table), (low, high), reached, share, spans))
    return tuple(found)


def _of_outputs(model: ActuatorModel, experiment: Experiment) -> tuple[np.ndarray, tuple[bool, ...], np.ndarray]:
    """(noise, whether it has an offset, what the band has beside the variances), of each output and each series."""
    known = {one.name: one for one in model.outputs}
    noise, offset, missed = [], [], []
    for output in experiment.outputs:
        own = known.get(output.name)
        noise.append(output.noise_sigma if own is None else own.noise)
        offset.append(output.offset if own is None else own.offset)
        error = None if own is None else own.prediction_error
        missed.append(NORMAL * noise[-1] if error is None else error)
    return np.asarray(noise), tuple(offset), np.tile(missed, len(experiment.runs))[:, None]


def _problem(
    model: ActuatorModel, likely: LikelyModel, experiment: Experiment, noise: np.ndarray, offset: tuple[bool, ...]
) -> Problem:
    system = model.system_of(likely.effects, likely.values)
    # Without what was measured: a prediction does not know it, and a sensor that shows levels shows them.
    batch = replace(pack(experiment.runs, experiment.step, parameter_values(system)), level=None)
    return Problem.build(system, batch, jnp.asarray(noise) if len(noise) > 1 else float(noise[0]), offset)


def _series(
    output: Output, run: Run, predicted: tuple[np.ndarray, np.ndarray], known: ModelOutput | None, offset: float
) -> PredictedSeries:
    """`predicted`: (reading, half width of the band), (n,) each."""
    measured, (reading, half) = run.outputs[output.name], predicted
    present = np.isfinite(measured)
    error = (measured - reading)[present]
    # The noise of these logs: that of a fit may hold what the model lacks, beside which nothing moves.
    share = in_band(measured, reading, half, output.noise_sigma)
    return PredictedSeries(
        output=output.name,
        unit=output.unit,
        measured=measured,
        reading=reading,
        half_width=half,
        noise=output.noise_sigma if known is None else known.noise,
        offset=float(offset),
        rmse=float(np.sqrt(np.mean(error**2))) if error.size else float("nan"),
        coverage=share.whole,
        moving=moving(measured, output.noise_sigma),
        moving_coverage=share.moving,
    )
