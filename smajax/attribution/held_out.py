"""Runs that no fit saw: simulated when the search is over, no effect is added for them, and they reject what they do not validate.

The bands about their predictions are made in `averaged_prediction`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import jax.numpy as jnp
import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import OutputFinding, Rejected, ResidualDiagnostics, RunFinding
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.job import Job
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.optimum import final_model, without
from smajax.attribution.paired_errors import Comparison, pooled_rms, runs_compared
from smajax.attribution.reasons import HeldOutWorse
from smajax.attribution.residual_diagnostics import diagnosed, noise_by_output, noise_like
from smajax.attribution.run_finding import BesideModels
from smajax.attribution.values_per_run import on_runs
from smajax.core.parameters import parameter_values
from smajax.data.experiment.record import Experiment, Output, Run
from smajax.fit.integration import unlimited
from smajax.fit.packed_runs import RunBatch, pack, simulate_with_outputs, states_by_run
from smajax.fit.zero_of_run import with_zero
from smajax.model.channels import SHOWN
from smajax.model.types import Trajectory

Compared = tuple[tuple[RunFinding, ...], ResidualDiagnostics, ResidualDiagnostics]


def validated(
    job: Job, setting: Search, search: JointSearch, first: Model, final: Model
) -> tuple[Model, Compared, Rejected | None]:
    """What the held-out runs leave of `final`: (model, every run by it, what they rejected).

    No fit sees them and nothing is added for them. They reject effects one after the other, beginning with the one that the evidence needs
    least, as long as they are predicted worse with it than without it beyond chance (`paired_errors`), or worse than by the base
    model: beyond chance, or, by a model that leaves more than noise of the fit runs, by `held_out_worse`. In that case an effect stays whose removal makes it worse still, and another goes; all do where each would.
    """
    error = search.error_of(final.effects)
    compared = whole = compare(job, setting, first, final)
    left = final
    if all(run.role == "fit" for run in compared[0]):
        return left, compared, None
    while left.effects and (rest := _with_one_fewer(job, setting, search, first, left, compared, error)) is not None:
        left = first if rest is first else final_model(search, setting, search.fitted[rest.effects], error)
        compared = compare(job, setting, first, left)
    gone = tuple(name for name in final.effects if name not in left.effects)
    if not gone:
        return left, compared, None
    without_them, with_them = (
        pooled_rms([left for run in one[0] if run.role == "held-out" for left in run.residuals("after")])
        for one in (compared, whole)
    )
    setting.set_aside(final, HeldOutWorse(without_them, with_them), gone)
    beyond_chance = "worse" in (_beside(whole, compared, setting), _beside(whole, whole, setting, "before"))
    return left, compared, Rejected(gone, without_them, with_them, may_be_chance=not beyond_chance)


def _with_one_fewer(  # what `validated` has at hand
    job: Job, setting: Search, search: JointSearch, first: Model, left: Model, compared: Compared, error: float
) -> Model | FittedModel | None:
    """`left` without the effect that the held-out runs reject; `first` where all go, and None where none does."""
    worse_than_base = _worse_than_base(compared, setting)
    for effect in reversed(left.effects):
        rest = without(search, left, effect, error) if len(left.effects) > 1 else first
        simpler = compare(job, setting, first, rest)
        if _beside(compared, simpler, setting) == "worse":
            return rest
        if not worse_than_base:
            return None
        if _beside(simpler, compared, setting) != "worse":
            return rest
    return first


def _worse_than_base(compared: Compared, setting: Search) -> bool:
    """Whether the held-out runs are predicted worse than by the base model. Few runs hardly tell that beyond chance; a model that does not explain the fit runs either has nothing to set against it."""
    if _beside(compared, compared, setting, "before") == "worse":
        return True
    if noise_like(compared[2], setting.config):
        return False
    held_out = [run for run in compared[0] if run.role == "held-out"]
    mine, theirs = ([left for run in held_out for left in run.residuals(which)] for which in ("after", "before"))
    return bool(mine) and pooled_rms(mine) > setting.config.held_out_worse * pooled_rms(theirs)


def _beside(new: Compared, old: Compared, setting: Search, which: Literal["before", "after"] = "after") -> Comparison:
    """How the held-out runs are predicted by the extended model of `new` beside that, or the base model, of `old`."""
    mine, theirs = ([run for run in one[0] if run.role == "held-out"] for one in (new, old))
    return runs_compared(mine, theirs, which, setting.config)


def _simulated(
    setting: Search, model: Model | FittedModel, batch: RunBatch, runs: Sequence[str]
) -> tuple[Trajectory, np.ndarray, dict[str, dict[str, float]]]:
    """(trajectories, sensors' outputs, values of each run's own by its name, without what single runs alone have)."""
    there, (values,) = on_runs(setting, model.effects, [model.values], batch, runs)
    own = np.asarray(there.per_run_at(jnp.asarray(values))).tolist()
    names, single = there.per_run.names, there.per_run.single
    named = {
        run: {name: value for name, value in zip(names, row, strict=True) if name not in single}
        for run, row in zip(runs, own, strict=True)
    }
    return *simulate_with_outputs(there.system_at(jnp.asarray(values)), there.with_own_values(values)), named


def every_run(job: Job) -> RunBatch:
    """All runs, held-out ones included, integrated as finely as in the fits."""
    experiment, integration = job.experiment, unlimited(job.problem.batch.integration)
    return pack(experiment.runs, experiment.step, parameter_values(job.problem.system), integration)


def compare(job: Job, setting: Search, first: Model, final: Model | FittedModel) -> Compared:
    """Every run, held-out ones included, by both models; and the diagnostics of the fit runs' residuals."""
    experiment, batch = job.experiment, every_run(job)
    names = [run.name for run in experiment.runs]
    simulated = {which: _simulated(setting, one, batch, names) for which, one in (("before", first), ("after", final))}
    shown = {which: states_by_run(one, experiment.runs, SHOWN) for which, (one, *_) in simulated.items()}
    runs = []
    residuals: dict[str, list[np.ndarray]] = {"before": [], "after": []}
    states: dict[str, list[dict[str, np.ndarray]]] = {"before": [], "after": []}
    outputs: dict[str, list[str]] = {"before": [], "after": []}  # of each residual
    count = len(experiment.outputs)
    for index, run in enumerate(experiment.runs):
        readings = {which: one[index * count : (index + 1) * count] for which, (_, one, _) in simulated.items()}
        found = _run_finding(experiment, run, readings, shown["after"][run.name])
        if found.role == "held-out":
            own = {which: one[run.name] for which, (*_, one) in simulated.items()}
            found = replace(found, own_before=own["before"], own_after=own["after"])
        runs.append(found)
        if found.role == "fit":
            for which in states:
                series = _series(run, shown[which][run.name])
                residuals[which] += found.residuals("before" if which == "before" else "after")
                for output, measured in run.outputs.items():
                    there = np.isfinite(measured)
                    if there.any():
                        outputs[which].append(output)
                        states[which].append({name: values[there] for name, values in series.items()})
    noise = experiment.noise_sigma, all(output.noise_given for output in experiment.outputs)
    before, after = (
        replace(
            diagnosed(residuals[which], states[which], *noise, setting.config),
            noise_by_output=_noise_by_output(experiment, residuals[which], outputs[which], setting.config),
        )
        for which in ("before", "after")
    )
    return tuple(runs), before, after


def _noise_by_output(
    experiment: Experiment, residuals: Sequence[np.ndarray], outputs: Sequence[str], config: AttributionConfig
) -> dict[str, bool]:
    """Of several outputs whether the residuals of each, in noises of the first, are noise."""
    if len(experiment.outputs) == 1:
        return {}
    names = [output.name for output in experiment.outputs]
    by_output = [[left for left, own in zip(residuals, outputs, strict=True) if own == name] for name in names]
    given = [output.noise_given for output in experiment.outputs]
    return dict(zip(names, noise_by_output(by_output, experiment.noise_sigma, given, config), strict=True))


def _run_finding(
    experiment: Experiment, run: Run, readings: Mapping[str, np.ndarray], states: dict[str, np.ndarray]
) -> RunFinding:
    """`readings` of both models, (outputs, N): the first output in the record itself, the others as `others`."""
    first, *others = (
        _beside_models(output, run.outputs[output.name], readings["before"][k], readings["after"][k])
        for k, output in enumerate(experiment.outputs)
    )
    sigma = experiment.noise_sigma
    return RunFinding(
        name=run.name,
        role="fit" if run.role == "fit" else "held-out",
        time=run.time,
        inputs=run.inputs,
        states=states,
        others=tuple(
            OutputFinding(
                name=output.name,
                unit=output.unit,
                noise_sigma=output.noise_sigma,
                noise_how=output.noise_how,
                scale=sigma / output.noise_sigma,
                **vars(one),
            )
            for output, one in zip(experiment.outputs[1:], others, strict=True)
        ),
        **vars(first),
    )


def _beside_models(output: Output, measured: np.ndarray, before: np.ndarray, after: np.ndarray) -> BesideModels:
    (first, zero, error), (final, zero_after, error_after) = (
        with_zero(measured, reading[: len(measured)], output.offset) for reading in (before, after)
    )
    return BesideModels(
        measured=measured,
        before=first,
        after=final,
        offset_before=zero,
        offset_after=zero_after,
        rmse_before=error,
        rmse_after=error_after,
    )


def _series(run: Run, states: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What a residual is held against."""
    series = {"time": run.time - run.time[0], **states, "temperature_rate": np.gradient(states["temperature"])}
    return series | {name: values for name, values in run.inputs.items() if name not in series}
