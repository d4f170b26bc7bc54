"""The main job: experiment -> check -> base fit -> residual -> search -> extended model -> findings."""

from __future__ import annotations

import hashlib
import time as clock
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from smajax.attribution.bootstrap import bootstrapped
from smajax.attribution.extent import extent_of
from smajax.attribution.judging import FORETELLS, Evidence, Model, Search
from smajax.attribution.lone_run import lone_runs
from smajax.attribution.rivals import rivals
from smajax.attribution.search import fewer, scores_at, search
from smajax.attribution.unknown import Lacking, in_place_of, unknown_terms
from smajax.attribution.unknown_words import told_of
from smajax.attribution.verdict import cannot_know, pooled, shown, summary, unexplained, verdict
from smajax.catalogue import candidates
from smajax.effects.library import LIBRARY
from smajax.effects.neutral import check_neutral
from smajax.experiment.catalogue import WIRE_SIZES
from smajax.experiment.errors import ExperimentError
from smajax.experiment.record import RUN_STARTS, Experiment, Run
from smajax.extended import base_model, extended
from smajax.fit.batch import RunBatch, halved, pack, simulate_batch
from smajax.fit.kept import Kept
from smajax.fit.problem import Problem
from smajax.fit.progress import Progress, quiet, say_checked
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.uncertainty import Uncertainty, identifiability, uncertainty
from smajax.load.coupon import AbstractCoupon
from smajax.made_with import made_with
from smajax.parameters import get_parameters, parameter_values, parameters
from smajax.presets import build
from smajax.report.display import digits, display
from smajax.report.findings import (
    CoefficientFinding,
    EffectFinding,
    Findings,
    LoneRun,
    ParameterFinding,
    Portrait,
    RunFinding,
)
from smajax.residual.portrait import portrait
from smajax.types import Trajectory

SEED = 2004
LOGGED = {"mass": "load_mass", "ambient_temperature": "ambient_temperature"}  # input channel -> what it replaces

# Of an effect beside others: by so much the error on held-out runs may be larger with it than without it by chance.
WORSE = 0.02
_Compared = tuple[tuple[RunFinding, ...], Portrait, Portrait]
_Refused = tuple[tuple[str, ...], float, float]  # effects, error on the held-out runs without and with them


@dataclass(frozen=True)
class _Job:
    """What every stage of one loop shares."""

    experiment: Experiment
    fit_runs: tuple[Run, ...]
    problem: Problem
    held_out: RunBatch | None
    unknowns: tuple[str, ...]
    bounds: dict[str, tuple[float, float]]
    candidates: tuple[str, ...]


def _job(experiment: Experiment) -> _Job:
    base = base_model(experiment)
    declared = experiment.declared_effects
    names = candidates(base, experiment.effects_only, (*experiment.effects_excluded, *declared), experiment.clocked)
    known = {**experiment.parameters, **{unknown.name: unknown.start for unknown in experiment.unknowns}}
    runs = tuple(run for run in experiment.runs if run.role == "fit")

    def problem_with(effects: tuple[str, ...]) -> Problem:
        model = extended(base, effects, {name: value for name, value in known.items() if "." in name})
        batch = pack(runs, experiment.step, parameter_values(model))
        return Problem.build(model, batch, experiment.noise_sigma, experiment.offset)

    extent = extent_of(problem_with(declared))
    names = tuple(name for name in names if LIBRARY[name].shows(extent))
    problem = problem_with((*declared, *names))
    full = problem.system
    bounds = {entry.name: (entry.low, entry.high) for entry in parameters(full).values()}
    bounds |= {f"{name}.{own}": one for name in names for own, one in LIBRARY[name].spans(extent).items()}
    bounds |= {unknown.name: (unknown.low, unknown.high) for unknown in experiment.unknowns}
    others = tuple(run for run in experiment.runs if run.role != "fit")
    held_out = pack(others, experiment.step, parameter_values(full)) if others else None
    return _Job(experiment, runs, problem, held_out, tuple(u.name for u in experiment.unknowns), bounds, names)


def close_loop(
    experiment: Experiment,
    *,
    memory: Path | None = None,
    progress: Progress = quiet,
    command: str = "",
    seed: int = SEED,
    apart: bool = False,
) -> Findings:
    """Fit the base model, look at what it leaves, find what it lacks, and judge on runs the fit never saw.

    `memory` is a folder for finished fits: a loop that was interrupted goes on from there. `apart`: of `Search`. Held-out runs are simulated
    when the search is over: they can refuse what it found, and choose nothing. The caller chooses precision; anything but float64 is refused with a ValueError, because the
    differences that decide here are far below float32's rounding over a run. Raises PluginError for an effect of another
    package that changes the model at its base value: every verdict would be wrong.
    """
    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError(
            "close_loop needs float64, but JAX runs in float32. Call `jax.config.update('jax_enable_x64', True)` first."
        )
    _refuse_what_only_identify_does(experiment)
    check_neutral()
    began = clock.monotonic()
    job = _job(experiment)
    kept = Kept(memory)
    progress("checking what these runs can tell", 0.0)
    start = job.problem.start_values()
    setting = Search(
        job.problem,
        job.unknowns,
        job.bounds,
        job.candidates,
        kept,
        lambda value: shown(value, experiment.output_unit, experiment.output_name),
        progress,
        experiment.outputs[0].noise_given,
        job.held_out,
        apart,
    )
    at_start = sensitivity(job.problem, start, job.unknowns)
    can_tell = identifiability(at_start, job.unknowns, job.bounds)
    check = [*experiment.warnings, *can_tell]
    progress("checking what these runs can tell", 1.0)
    say_checked(progress, experiment.warnings, can_tell)

    first, final = search(setting, setting.base(start, seed))
    lacking: Lacking | None = None
    aside: tuple[str, ...] = ()
    if final.effects and not setting.is_noise(final.values):
        lacking = in_place_of(setting, first, final)
        if lacking is not None:
            final, aside = first, final.effects
        elif not setting.foretells(final.left_out_rmse):
            share = max(setting.foretold(final.left_out_rmse), 0.0)
            why = f"with it the model foretells {share:.0%} of the motion in runs left out, and under {FORETELLS:.0%} an effect means nothing"
            setting.set_aside(final, why)
            final = first

    lone: tuple[LoneRun, ...] = ()
    if not setting.is_noise(final.values):
        names = [run.name for run in job.fit_runs]
        lone = lone_runs(setting, first, names)
        if final.effects and not any(one.noise for one in lone):
            lone = lone_runs(setting, final, names) or lone
        elif final.effects:
            setting.set_aside(final, f"without {lone[0].run} what the base model leaves is noise")
            final, lacking = first, None

    final, compared, refused = _borne_out(job, setting, first, final)

    progress("standard errors and pictures", 0.0)
    before = _told(job, setting, first, start)
    after = _told(job, setting, final, start) if final.effects else before
    intervals = bootstrapped(setting, final, seed)
    effects = _effects(job, setting, final, after, intervals)
    mistaken = rivals(setting, final, job.fit_runs)
    runs, portrait_before, portrait_after = compared
    integration = _integration_error(job, final)
    progress("standard errors and pictures", 1.0)
    answer = verdict(final.effects, portrait_after)
    if lacking is None:
        more = answer in ("partly explained", "not in the library") and not any(one.noise for one in lone)
        lacking = unknown_terms(setting, final) if more else Lacking()
    if lacking.terms and not setting.foretells(lacking.terms[0].left_out_after):
        lacking, aside = Lacking(), ()
    unknown = lacking.terms
    blind = answer == "not in the library" and not unknown and not setting.foretells(final.left_out_rmse)
    foretold = setting.foretold(final.left_out_rmse) if blind else None
    added = tuple(f"{name}." for name in final.effects)
    opening, *rest = summary(
        answer,
        experiment,
        runs,
        effects,
        portrait_after,
        len(job.candidates),
        aside,
        foretold,
        refused,
        [one.name for one in after.parameters if one.name.startswith(added) and _asks_for_more(one)],
        [one for one in mistaken if one.weight > 0.5],
        _sizes_not_given(job),
        [one for one in after.parameters if not one.name.startswith(added) and _asks_for_more(one)],
        integration,
        lone,
    )
    return Findings(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        verdict=answer,
        summary=(opening, *told_of(unknown, setting.shown), *rest),
        unexplained=unexplained(answer, experiment, runs, portrait_after),
        cannot_know=cannot_know(
            experiment,
            after.parameters,
            effects,
            setting.rounds,
            mistaken,
            len(job.fit_runs),
            integration,
            _preset(job),
            after.uncertainty.together,
        ),
        check=tuple(check),
        output_name=experiment.output_name,
        output_unit=experiment.output_unit,
        noise_sigma=experiment.noise_sigma,
        noise_how=experiment.noise_how,
        runs=runs,
        before=before.parameters,
        after=after.parameters,
        effects=effects,
        portrait_before=portrait_before,
        portrait_after=portrait_after,
        rounds=tuple(setting.rounds),
        rivals=mistaken,
        unknown=unknown,
        lone_runs=lone,
        provenance=_provenance(experiment, kept, command, seed, clock.monotonic() - began),
    )


def _refuse_what_only_identify_does(experiment: Experiment) -> None:
    """ExperimentError for the keys of an experiment file that this loop would otherwise pass over in silence."""

    def refuse(key: str, what: str) -> None:
        raise ExperimentError(experiment.path, key, f"close-loop {what}; `smajax identify` does, or remove it")

    if len(experiment.outputs) > 1:
        others = ", ".join(output.name for output in experiment.outputs[1:])
        refuse("channels", f"fits one output and got {len(experiment.outputs)} (also {others})")
    own = build(experiment.wire, experiment.load, experiment.drive).load.reading[0]
    if experiment.output_name != own:
        refuse(f"channels.{experiment.output_name}", f"fits the load's own sensor, {own!r}, and no other")
    for unknown in experiment.unknowns:
        place = "nuisance" if unknown.name in RUN_STARTS else "unknown"
        if unknown.per_run:
            refuse(f"{place}.{unknown.name}", "knows no value of each run's own but the offset")
        if unknown.prior is not None:
            refuse(f"{place}.{unknown.name}.prior", "takes no prior")
    for run in experiment.runs:
        if not np.isfinite(run.output).all():
            refuse(
                f"channels.{experiment.output_name}.missing", f"leaves out no sample, and run {run.name!r} lacks some"
            )


def _preset(job: _Job) -> dict[str, str]:
    """Parameters of the base model that are not fitted and that no log gives: name -> value and unit as a reader sees them."""
    model = base_model(job.experiment)
    logged = {own for channel, own in LOGGED.items() if all(channel in run.inputs for run in job.experiment.runs)}
    table = {name: entry for name, entry in parameters(model).items() if name not in {*job.unknowns, *logged}}
    values = np.asarray(get_parameters(model, list(table))) if table else ()
    return {
        name: f"{digits(display(entry.unit, name).of(float(value)))} {display(entry.unit, name).unit}".strip()
        for (name, entry), value in zip(table.items(), values, strict=True)
    }


def _sizes_not_given(job: _Job) -> list[str]:
    """Sizes of the wire and numbers of the load that are the presets' in every run, with their values."""
    experiment, table = job.experiment, parameters(base_model(job.experiment))
    own = set.intersection(*({*run.parameters} for run in experiment.runs))
    return [
        f"{name} {value}"
        for name, value in _preset(job).items()
        if (name in WIRE_SIZES or table[name].path[0] == "load") and name not in {*experiment.parameters, *own}
    ]


def _asks_for_more(one: ParameterFinding) -> bool:
    """Whether a parameter is at a bound that it might lie beyond: a share of all or of nothing is not."""
    return one.remark.startswith("at its") and (one.unit, one.lower, one.upper) != ("-", 0.0, 1.0)


@dataclass(frozen=True)
class _Told:
    parameters: tuple[ParameterFinding, ...]
    uncertainty: Uncertainty


def _told(job: _Job, setting: Search, model: Model, start: np.ndarray) -> _Told:
    """Every free parameter of `model` with its standard error and remark."""
    names = setting.free(model.effects)
    index = job.problem.names.index
    at: Sensitivity = sensitivity(job.problem, model.values, names)
    values = {name: float(model.values[index(name)]) for name in names}
    known = uncertainty(at, names, values, job.bounds)
    table = parameters(job.problem.system)
    return _Told(
        tuple(
            ParameterFinding(
                name,
                table[name].unit,
                values[name],
                known.standard_error[name],
                *job.bounds[name],
                float(start[index(name)]),
                known.remark[name],
            )
            for name in names
        ),
        known,
    )


def _effects(
    job: _Job, setting: Search, final: Model, after: _Told, intervals: dict[str, tuple[float, float]]
) -> tuple[EffectFinding, ...]:
    """Every candidate with its evidence: added ones first, the strongest of them at the head, then by score."""
    left = [name for name in job.candidates if name not in final.effects]
    last = {score.effects[0]: score for score in scores_at(setting, final, left)[0]} if left else {}
    told = {parameter.name: parameter for parameter in after.parameters}
    findings = []
    for name in job.candidates:
        effect, seen = LIBRARY[name], setting.evidence.get(name, Evidence())
        coefficients = {
            full.split(".", 1)[1]: CoefficientFinding(
                told[full].value,
                told[full].standard_error,
                told[full].unit,
                _spread(intervals.get(full), told[full].standard_error),
            )
            for full in setting.coefficients(name)
            if full in told
        }
        evidence = {
            "score_gain": seen.first_score.gain if seen.first_score else float("nan"),
            "score_statistic": seen.first_score.statistic if seen.first_score else float("nan"),
            "score_p_value": seen.first_score.p_value if seen.first_score else float("nan"),
            "alone_rmse_fit": seen.alone_rmse,
            "leave_one_out_rmse": seen.alone_left_out_rmse,
            "leave_one_out_rmse_of_the_base_model": seen.base_left_out_rmse,
            "leave_one_out_rmse_without": seen.without_left_out_rmse,
            "score_p_value_at_the_end": last[name].p_value if name in last else float("nan"),
            "score_gain_at_the_end": last[name].gain if name in last else float("nan"),
        }
        findings.append(
            EffectFinding(
                name,
                effect.title,
                effect.equation,
                effect.formula,
                effect.sentence,
                name in final.effects,
                coefficients,
                evidence,
            )
        )

    def strength(one: EffectFinding) -> tuple[bool, float, float]:
        alone = one.evidence["alone_rmse_fit"] if one.added else np.nan
        return not one.added, float(np.nan_to_num(alone, nan=np.inf)), -float(np.nan_to_num(one.evidence["score_gain"]))

    return tuple(sorted(findings, key=strength))


def _simulated(problem: Problem, values: np.ndarray, batch: RunBatch) -> Trajectory:
    return simulate_batch(problem.system_at(jnp.asarray(values)), batch)


def _compare(job: _Job, first: Model, final: Model) -> _Compared:
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


def _spread(interval: tuple[float, float] | None, error: float | None) -> tuple[float, float] | None:
    """What fits to runs drawn anew say, where it is wide enough to say something.

    Where it is narrower than the standard error either way the tie to the fit holds the value there, and not the runs.
    """
    return None if interval is None or error is None or interval[1] - interval[0] < 2.0 * error else interval


def _integration_error(job: _Job, final: Model) -> float:
    """By how much the output (rms, worst fit run, SI, offset aside) changes when the step is halved."""
    if isinstance(job.problem.system.load, AbstractCoupon):
        return 0.0  # a closed form at each sample
    batch, values = job.problem.batch, final.values
    coarse = _simulated(job.problem, values, batch).reading
    fine = _simulated(job.problem, values, halved(batch)).reading[:, ::2]
    change, mask = np.asarray(fine - coarse), np.asarray(batch.mask)
    centred = change - (job.experiment.offset * (change * mask).sum(1) / mask.sum(1))[:, None]
    return float(np.sqrt(((centred * mask) ** 2).sum(1) / mask.sum(1)).max())


def _borne_out(job: _Job, setting: Search, first: Model, final: Model) -> tuple[Model, _Compared, _Refused | None]:
    """What the held-out runs leave of `final`: (model, every run by it, what they refused).

    They have had no part in anything before, and can only refuse: the effect that came last first, as long as with it their
    error is larger than without it, or no smaller than the base model's. It may be larger by `WORSE` where others are left.
    """

    def held_out(compared: _Compared, which: str = "after") -> float:
        return pooled(compared[0], "held-out", which)

    compared = whole = _compare(job, first, final)
    left = final
    while left.effects:
        rest = fewer(setting, left) if len(left.effects) > 1 else first
        without = _compare(job, first, rest)
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


def _provenance(experiment: Experiment, kept: Kept, command: str, seed: int, seconds: float) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "step": f"{experiment.step} s",
        "seconds": f"{seconds:.0f}",
        "batches of fits taken from an earlier, interrupted run": str(kept.reused),
        "sha256 of the experiment file": hashlib.sha256(experiment.path.read_bytes()).hexdigest(),
        **{f"sha256 of {run.name}": run.sha256 for run in experiment.runs},
    }
