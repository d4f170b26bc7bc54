"""Runs that no fit saw: simulated when the search is over, no effect is added for them, and they refuse what they do not bear out."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from smajax.attribution.cross_validation import Model, Search
from smajax.attribution.findings import Portrait, RunFinding
from smajax.attribution.job import Job
from smajax.attribution.residual_diagnostics import portrait
from smajax.attribution.search import fewer
from smajax.attribution.verdict import pooled
from smajax.core.parameters import parameter_values
from smajax.data.experiment.record import Run
from smajax.fit.packed_runs import RunBatch, pack, simulate_batch
from smajax.fit.problem import Problem
from smajax.model.types import Trajectory

# Of an effect beside others: by so much the error on held-out runs may be larger with it than without it by chance.
WORSE = 0.02
Compared = tuple[tuple[RunFinding, ...], Portrait, Portrait]
Refused = tuple[tuple[str, ...], float, float]  # effects, error on the held-out runs without and with them


def borne_out(job: Job, setting: Search, first: Model, final: Model) -> tuple[Model, Compared, Refused | None]:
    """What the held-out runs leave of `final`: (model, every run by it, what they refused).

    No fit sees them and nothing is added for them. They refuse: the effect that came last first, as long as with it their
    error is larger than without it, or no smaller than the base model's. It may be larger by `WORSE` where others are left.
    """

    def held_out(compared: Compared, which: str = "after") -> float:
        return pooled(compared[0], "held-out", which)

    compared = whole = compare(job, first, final)
    left = final
    while left.effects:
        rest = fewer(setting, left) if len(left.effects) > 1 else first
        without = compare(job, first, rest)
        now = held_out(compared)
        if not (now >= held_out(compared, "before") or now > (1.0 + WORSE) * held_out(without)):
            break
        left, compared = rest, without
    gone = tuple(name for name in final.effects if name not in left.effects)
    if not gone:
        return left, compared, None
    without_them, with_them = held_out(compared), held_out(whole)
    told = f"error on the held-out runs {setting.shown(without_them)} without and {setting.shown(with_them)} with it"
    setting.set_aside(final, told, gone)
    return left, compared, (gone, without_them, with_them)


def _simulated(problem: Problem, values: np.ndarray, batch: RunBatch) -> Trajectory:
    return simulate_batch(problem.system_at(jnp.asarray(values)), batch)


def compare(job: Job, first: Model, final: Model) -> Compared:
    """Every run, held-out ones included, by both models; and the portraits of the fit runs' residuals."""
    experiment = job.experiment
    batch = pack(experiment.runs, experiment.step, parameter_values(job.problem.system))
    before = _simulated(job.problem, first.values, batch)
    after = _simulated(job.problem, final.values, batch)
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
                states[which].append(_series(run, trajectory, index))
        shown = {
            name: np.asarray(getattr(after, name))[index, :n]
            for name in ("temperature", "martensite_fraction", "stress")
        }
        runs.append(
            RunFinding(
                run.name,
                "fit" if run.role == "fit" else "held-out",
                run.time,
                run.inputs,
                run.output,
                readings["before"],
                readings["after"],
                shown,
                offsets["before"],
                offsets["after"],
                errors["before"],
                errors["after"],
            )
        )
    noise = experiment.noise_sigma, experiment.outputs[0].noise_given
    return (
        tuple(runs),
        portrait(residuals["before"], states["before"], *noise),
        portrait(residuals["after"], states["after"], *noise),
    )


def _series(run: Run, trajectory: Trajectory, index: int) -> dict[str, np.ndarray]:
    """What a residual is held against."""
    n = len(run.time)
    temperature = np.asarray(trajectory.temperature)[index, :n]
    series = {
        "time": run.time - run.time[0],
        "temperature": temperature,
        "martensite_fraction": np.asarray(trajectory.martensite_fraction)[index, :n],
        "stress": np.asarray(trajectory.stress)[index, :n],
        "temperature_rate": np.gradient(temperature),
    }
    return series | {name: values for name, values in run.inputs.items() if name not in series}
