"""What a model file takes over from the experiment whose runs it was fitted to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from smajax.core.parameters import Parameter, parameter_values, parameters
from smajax.data.experiment.record import Experiment, Run
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.record import (
    FittedRun,
    LikelyModel,
    ModelOutput,
    ModelParameter,
)
from smajax.model.channels import REPLACED
from smajax.model.extended import extended
from smajax.model.presets import build


def actuator_model(
    experiment: Experiment,
    likely: Sequence[LikelyModel],
    bounds: Mapping[str, tuple[float, float]],
    standard_errors: Mapping[str, float | None],
    outputs: Sequence[ModelOutput],
    fitted_range: Mapping[str, tuple[float, float]],
) -> ActuatorModel:
    """The first of the `likely` models, with what was given in the experiment file, and the rest of the presets.

    bounds, standard_errors: of the fitted values, SI.
    """
    first = likely[0]
    system = extended(build(experiment.wire, experiment.load, experiment.drive, experiment.law), first.effects)
    start = {**parameter_values(system), **experiment.base_values}
    values = {
        name: _parameter(experiment, entry, start[name], first, bounds.get(name), standard_errors.get(name))
        for name, entry in parameters(system).items()
    }
    return ActuatorModel(
        title=experiment.title or experiment.name,
        wire=experiment.wire,
        load=experiment.load,
        drive=experiment.drive,
        law=experiment.law,
        effects=tuple(one.effect_name for one in system.effects),
        parameters=values,
        outputs=tuple(outputs),
        likely=tuple(likely),
        fitted_range={**fitted_range, **_ranges_of_runs(experiment, values)},
        runs=tuple(FittedRun(run.name, run.role, run.sha256) for run in experiment.runs),
        log_format=experiment.log_format,
        made_with={"experiment": experiment.path.name},
    )


def _ranges_of_runs(experiment: Experiment, values: Mapping[str, ModelParameter]) -> dict[str, tuple[float, float]]:
    """Lowest and highest of the parameters that fit runs have their own values of; a run without one has the model's."""
    fit = [run for run in experiment.runs if run.role == "fit"]
    names = {name for run in fit for name in run.parameters if name != "initial_temperature"}
    ranges = {}
    for name in sorted(names):
        of_runs = [run.parameters[name] for run in fit if name in run.parameters]
        of_runs += [values[name].value] * (name in values and bool(_without_own(fit, name)))
        ranges[name] = (rounded(min(of_runs)), rounded(max(of_runs)))
    return ranges


def _without_own(runs: Iterable[Run], name: str) -> list[Run]:
    """The runs that neither log a parameter nor have their own value of it: they are simulated with the experiment's."""
    return [run for run in runs if name not in run.parameters and REPLACED.get(name, "") not in run.inputs]


def _parameter(
    experiment: Experiment,
    entry: Parameter,
    start: float,
    fitted: LikelyModel,
    bounds: tuple[float, float] | None,
    error: float | None,
) -> ModelParameter:
    """One value: of this fit, given in the experiment file, of a fit before in its model file, or of a preset."""
    name, kept = entry.name, experiment.model_file
    low, high = (rounded(one) for one in bounds or (entry.low, entry.high))
    if name in fitted.values:
        return ModelParameter(
            float(fitted.values[name]), "fitted", low, high, None if error is None else rounded(error)
        )
    logged = _logged(experiment, name)
    if logged is not None:
        return ModelParameter(logged, "given", entry.low, entry.high)
    if name in experiment.parameters:
        return ModelParameter(float(start), "given", entry.low, entry.high)
    stated = experiment.priors.presets.get(name)
    of_file = stated is not None and stated.base is not None  # it goes before what a fit left
    if kept is not None and name in kept.errors and not of_file:
        return ModelParameter(float(start), "fitted", *kept.bounds[name], kept.errors[name])
    return ModelParameter(float(start), "preset", entry.low, entry.high)


def _logged(experiment: Experiment, name: str) -> float | None:
    """The median over the fit runs of what an input channel, or each run's own value, gives in the place of a parameter; else None.

    Runs have their own, but a closed loop or a simulation without them is of this bench all the same. None too where the experiment's
    value is that of a fit run, or is given beside runs with their own: the model then keeps it, and predicts such a run as it was fitted.
    """
    channel = REPLACED.get(name, "")
    fit = [run for run in experiment.runs if run.role == "fit"]
    if _without_own(fit, name) or (name in experiment.parameters and not any(channel in run.inputs for run in fit)):
        return None
    series = [run.inputs[channel] for run in fit if channel in run.inputs]
    series += [
        np.asarray([run.parameters[name]]) for run in fit if name in run.parameters and channel not in run.inputs
    ]
    if not series:
        return None
    return rounded(float(np.quantile(np.concatenate(series), 0.5, method="nearest")))  # one that was there


def rounded(value: float) -> float:
    """To what a reader needs: six digits, of a number with which nothing is simulated."""
    return float(f"{value:.6g}")


def range_of(runs: Iterable[tuple[Run, Mapping[str, np.ndarray]]]) -> dict[str, tuple[float, float]]:
    """Lowest and highest of every input, and of the wire's temperature, its rate and its stress, over runs with their states (n,)."""
    found: dict[str, list[np.ndarray]] = {}
    for run, states in runs:
        for name, series in quantities(run.time, run.inputs, states).items():
            found.setdefault(name, []).append(series)
    return {
        name: (rounded(float(min(np.min(one) for one in many))), rounded(float(max(np.max(one) for one in many))))
        for name, many in found.items()
    }


def quantities(
    time: np.ndarray, inputs: Mapping[str, np.ndarray], states: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """What a fitted range holds, of one run: its inputs, temperature, temperature_rate and stress, each (n,), SI."""
    temperature = np.asarray(states["temperature"])
    rate = np.gradient(temperature, time) if len(time) > 1 else np.zeros_like(temperature)
    return {
        **{name: np.asarray(series) for name, series in inputs.items()},
        "temperature": temperature,
        "temperature_rate": rate,
        "stress": np.asarray(states["stress"]),
    }
