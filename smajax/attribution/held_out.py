"""Runs that no fit saw: simulated when the search is over, no effect is added for them, and they reject what they do not validate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import jax.numpy as jnp
import numpy as np

from smajax.attribution.findings import HeldOutWorse, Rejected, ResidualDiagnostics, RunFinding, pooled_rmse
from smajax.attribution.job import Job
from smajax.attribution.joint_search import JointSearch
from smajax.attribution.joint_stage import final_model, without
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.paired_errors import Comparison, runs_compared
from smajax.attribution.residual_diagnostics import diagnosed
from smajax.core.parameters import parameter_values
from smajax.data.experiment.record import Run
from smajax.fit.integration import unlimited
from smajax.fit.packed_runs import RunBatch, pack, simulate_batch, states_by_run
from smajax.model.channels import SHOWN
from smajax.model.types import Trajectory

Compared = tuple[tuple[RunFinding, ...], ResidualDiagnostics, ResidualDiagnostics]


def validated(
    job: Job, setting: Search, search: JointSearch, first: Model, final: Model
) -> tuple[Model, Compared, Rejected | None]:
    """What the held-out runs leave of `final`: (model, every run by it, what they rejected).

    No fit sees them and nothing is added for them. They reject effects one after the other, beginning with the one that the evidence needs
    least, as long as they are predicted worse with it than without it beyond chance (`paired_errors`), or worse than by the base
    model. In that case an effect stays whose removal makes it worse still, and another goes; all do where each would.
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
    without_them, with_them = (pooled_rmse(one[0], "held-out", "after") for one in (compared, whole))
    setting.set_aside(final, HeldOutWorse(without_them, with_them), gone)
    return left, compared, Rejected(gone, without_them, with_them)


def _with_one_fewer(  # what `validated` has at hand
    job: Job, setting: Search, search: JointSearch, first: Model, left: Model, compared: Compared, error: float
) -> Model | FittedModel | None:
    """`left` without the effect that the held-out runs reject; `first` where all go, and None where none does."""
    worse_than_base = _beside(compared, compared, setting, "before") == "worse"
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


def _beside(new: Compared, old: Compared, setting: Search, which: Literal["before", "after"] = "after") -> Comparison:
    """How the held-out runs are predicted by the extended model of `new` beside that, or the base model, of `old`."""
    mine, theirs = ([run for run in one[0] if run.role == "held-out"] for one in (new, old))
    return runs_compared(mine, theirs, which, setting.config)


def _simulated(setting: Search, model: Model | FittedModel, batch: RunBatch) -> Trajectory:
    problem, index = setting.restricted(model.effects)
    return simulate_batch(problem.system_at(jnp.asarray(model.values[index])), batch)


def every_run(job: Job) -> RunBatch:
    """All runs, held-out ones included, integrated as finely as in the fits."""
    experiment, integration = job.experiment, unlimited(job.problem.batch.integration)
    return pack(experiment.runs, experiment.step, parameter_values(job.problem.system), integration)


def compare(job: Job, setting: Search, first: Model, final: Model | FittedModel) -> Compared:
    """Every run, held-out ones included, by both models; and the diagnostics of the fit runs' residuals."""
    experiment, batch = job.experiment, every_run(job)
    before = _simulated(setting, first, batch)
    after = _simulated(setting, final, batch)
    shown = {which: states_by_run(one, experiment.runs, SHOWN) for which, one in (("before", before), ("after", after))}
    runs = []
    residuals: dict[str, list[np.ndarray]] = {"before": [], "after": []}
    states: dict[str, list[dict[str, np.ndarray]]] = {"before": [], "after": []}
    for index, run in enumerate(experiment.runs):
        n = len(run.time)
        readings, offsets, errors = {}, {}, {}
        for which, trajectory in (("before", before), ("after", after)):
            reading = np.asarray(trajectory.reading)[index, :n]
            offsets[which] = float(np.mean(run.output - reading)) if experiment.offset else 0.0
            readings[which] = reading + offsets[which]
            errors[which] = float(np.sqrt(np.mean((run.output - readings[which]) ** 2)))
            if run.role == "fit":
                residuals[which].append(run.output - readings[which])
                states[which].append(_series(run, shown[which][run.name]))
        runs.append(
            RunFinding(
                name=run.name,
                role="fit" if run.role == "fit" else "held-out",
                time=run.time,
                inputs=run.inputs,
                measured=run.output,
                before=readings["before"],
                after=readings["after"],
                states=shown["after"][run.name],
                offset_before=offsets["before"],
                offset_after=offsets["after"],
                rmse_before=errors["before"],
                rmse_after=errors["after"],
            )
        )
    noise = experiment.noise_sigma, experiment.outputs[0].noise_given
    return (
        tuple(runs),
        diagnosed(residuals["before"], states["before"], *noise, setting.config),
        diagnosed(residuals["after"], states["after"], *noise, setting.config),
    )


def _series(run: Run, states: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What a residual is held against."""
    series = {"time": run.time - run.time[0], **states, "temperature_rate": np.gradient(states["temperature"])}
    return series | {name: values for name, values in run.inputs.items() if name not in series}
