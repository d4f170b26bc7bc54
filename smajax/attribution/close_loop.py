"""The main job, stage by stage: experiment -> base fit -> search -> evidence -> held-out validation -> findings."""

from __future__ import annotations

import hashlib
import time as clock
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial, reduce
from pathlib import Path

import numpy as np

from smajax.attribution.assembled_findings import findings_of, known_so_far
from smajax.attribution.begun_ahead import begin_ahead, begin_findings, outliers_of
from smajax.attribution.config import AttributionConfig
from smajax.attribution.context import Context, Interim, Outcome
from smajax.attribution.declared_priors import of_unknowns
from smajax.attribution.findings import Findings, Rejected, Remaining
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.held_out import compare, validated
from smajax.attribution.input_of_run import FAR_LESS, begin_record_errors, corrected, record_errors, standing
from smajax.attribution.job import job_by_one_step
from smajax.attribution.joint_stage import (
    base_alone,
    search_again,
    search_beside_a_record,
    search_by_evidence,
    search_without,
)
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.neutral_at_base import check_neutral
from smajax.attribution.optimum import likeliest_so_far
from smajax.attribution.reasons import NoiseWithoutRun, PredictsTooLittle
from smajax.attribution.record_error import NO_RECORDS, CorrectedRecords, FoundRecordErrors, NotConfirmed
from smajax.attribution.record_fits import MOST_LEFT
from smajax.attribution.same_as_parameters import said_by_parameters
from smajax.attribution.step_size_check import finer_integration
from smajax.attribution.traces import begin_traces
from smajax.attribution.unknown.search import in_place_of
from smajax.core.blas_threads import on_one_blas_thread
from smajax.core.progress import Progress, Result, Stage, as_progress, quiet, report_warnings
from smajax.core.provenance import made_with
from smajax.core.result_cache import ResultCache
from smajax.core.runtime import require_float64
from smajax.data.experiment.record import Experiment
from smajax.fit.identifiability import Checks, TakenAt, identifiability
from smajax.fit.preset_priors import visible
from smajax.fit.sensitivity import sensitivity
from smajax.simulation.steppers import Integration

SEED = 2004
MOST_SEARCHES = 2  # the first, and again without what the held-out runs rejected
MOST_RECORD_ERRORS = 2  # of single runs that are corrected: with more of them nothing is left that says which is right
RARELY = 8.0  # times what the last page of a search took before the next
CHECKING = "checking what these runs determine"


@on_one_blas_thread
def close_loop(  # keywords, which a caller names one by one
    experiment: Experiment,
    *,
    memory: Path | None = None,
    progress: Progress = quiet,
    command: str = "",
    seed: int = SEED,
    compile_per_model: bool | None = None,
    config: AttributionConfig | None = None,
    apart: bool | None = None,
    interim: Interim | None = None,
) -> Findings:
    """Fit the base model, look at what it leaves, find what it lacks, and validate on runs the fit never saw.

    `memory` is a folder for finished fits: an attribution that was interrupted resumes from there.
    Held-out runs are simulated when the search is over: they reject what they do not validate, and nothing is added
    for them. The caller chooses precision; anything but float64 is refused with a ValueError, because the
    differences that decide here are far below float32's rounding over a run. `interim` gets what is known after the base fit, in a long search
    now and then, and after it where other stages follow: findings without a verdict, which say what is still to come; it may return the seconds that what it does beside the search takes. Raises PluginError for an effect of another
    package that changes the model at its base value: every verdict would be wrong.
    """
    require_float64("close_loop")
    for name, given in (("compile_per_model", compile_per_model), ("apart", apart)):
        if given is not None:
            text = f"`{name}` changes nothing: sets of effects share a program; it goes in version 0.3"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
    began = clock.monotonic()
    check_neutral()
    cache = ResultCache(memory)
    settings = config or AttributionConfig()
    context = prepared(experiment, cache, as_progress(progress), seed, settings, interim)
    if interim is not None:
        interim(known_so_far(context, base_alone(context.setting, context.base), Remaining.SEARCH))
    context, outcome = with_records_corrected(context)
    outcome = begin_findings(context, outcome)
    if interim is not None and not context.setting.is_noise(outcome.final):
        interim(known_so_far(context, (outcome.search, outcome.base, outcome.final), Remaining.CHECKS))
    outcome, rejected = against_the_held_out_runs(context, outcome)
    outcome = against_an_outlier_run(context, against_an_unknown_term(context, outcome))
    if leaves_little(context, outcome.final) or (outcome.lacking is not None and outcome.lacking.terms):
        context = replace(context, records=context.records.confirmed())
    found = findings_of(context, outcome, compare(context.job, context.setting, outcome.base, outcome.final), rejected)
    provenance = _provenance(experiment, cache, command, seed, clock.monotonic() - began)
    return replace(found, provenance=provenance)


def prepared(  # the stage's inputs, each once
    experiment: Experiment,
    cache: ResultCache,
    progress: Progress,
    seed: int,
    config: AttributionConfig,
    interim: Interim | None = None,
    integration: Integration | None = None,
    records: CorrectedRecords = NO_RECORDS,
) -> Context:
    """The experiment as a problem, its base model fitted, and what its runs determine, from the Jacobian there."""
    job = job_by_one_step(experiment)
    start = job.problem.start_values()
    setting = Search(
        problem=job.problem,
        unknowns=job.unknowns,
        bounds=job.bounds,
        candidates=job.candidates,
        cache=cache,
        progress=progress,
        noise_given=all(output.noise_given for output in experiment.outputs),
        noises_given=tuple(output.noise_given for output in experiment.outputs),
        held_out_runs=tuple(run.name for run in experiment.runs if run.role != "fit"),
        config=config,
        declared=experiment.priors,
        of_unknowns=of_unknowns(experiment),
    )
    begin_traces(setting.joint(setting.candidates, {}))  # what comes after the base fit, for any integration
    job = job.integrated(integration)
    setting.problem, setting.held_out = job.problem, job.held_out
    if integration is None:
        report_warnings(progress, experiment.warnings)
    base = setting.base(start, seed)
    # It was chosen where the fit begins, at which the wire may not even move. Now, and not when the whole search has been made with it.
    if integration is None and (finer := finer_integration(setting, (), base.values)) is not None:
        return prepared(experiment, cache, progress, seed, config, interim, finer, records)
    progress(Stage(CHECKING, 0.0))
    problem, index = setting.restricted(())
    at_fit = sensitivity(problem, base.values[np.asarray(index)], [*job.unknowns, *job.presets])
    values = dict(zip(job.problem.names, base.values.tolist(), strict=True))
    setting.presets = visible(at_fit, values, job.presets)
    identifiable = identifiability(at_fit, job.unknowns, job.bounds, TakenAt.BASE_FIT)
    joint = setting.joint(setting.candidates)
    checks = Checks(
        identifiable,
        hidden_by_one_force=job.hidden_by_one_force,
        freed_later=tuple(setting.presets),
        said_by_parameters=joint.ordered(tuple(said_by_parameters(joint))),
    )
    progress(Stage(CHECKING, 1.0))
    progress(Result(checks))
    context = Context(job, setting, start, base, seed, checks, interim, records)
    setting.after_round = None if interim is None else _now_and_then(context, interim)
    if records.asks and len(records.errors) < MOST_RECORD_ERRORS:
        setting.begin_wrong_record = partial(begin_record_errors, setting, runs=job.fit_runs)
        setting.wrong_record = partial(
            record_errors, setting, runs=job.fit_runs, times_less=FAR_LESS, trials=records.may_try
        )
    return context


def _now_and_then(context: Context, interim: Interim) -> Callable[[JointSearch, FittedModel], None]:
    """What gives `interim` the likeliest model after a round, so seldom that it takes a small part of the time."""
    began, cost = clock.monotonic(), context.setting.config.first_page / RARELY

    def after_round(search: JointSearch, best: FittedModel) -> None:
        nonlocal began, cost
        now = clock.monotonic()
        if best.effects and now - began > RARELY * cost:
            beside = interim(known_so_far(context, likeliest_so_far(search, best), Remaining.REST_OF_THE_SEARCH))
            began = clock.monotonic()
            cost = max(began - now, beside if isinstance(beside, float) else 0.0)

    return after_round


def with_records_corrected(context: Context, logged: Experiment | None = None) -> tuple[Context, Outcome]:
    """The search; where an input of a run was recorded wrongly, again with that run corrected. All else is asked of the runs as they should have been recorded.

    One that is corrected on trial stands where the model found at the end leaves little more than noise; all stand where that model needs them. Otherwise the search is made again without.
    `logged`: the experiment with all runs as they were logged; None: that of `context`.
    """
    begun, logged = context, logged or context.job.experiment
    first = context, outcome = searched_finely(context)
    while (wrong := wrong_record(context, outcome)) is not None:
        context.setting.progress(Result(wrong))
        records = replace(context.records, errors=(*context.records.errors, *wrong.errors))
        context = _again(context, reduce(corrected, wrong.errors, context.job.experiment), records)
        context, outcome = searched_finely(context, (outcome.search, wrong.beside))
    errors = context.records.errors
    stand = standing(errors, outcome.search, outcome.final, len(context.job.fit_runs))
    if context.records.on_trial and not leaves_little(context, outcome.final):
        stand = ()
    if len(stand) == len(errors):
        return context, outcome
    context.setting.progress(Result(NotConfirmed(tuple(one for one in errors if one not in stand))))
    # What was refused once may be found again by the next search, and no other one after that.
    records = CorrectedRecords(stand, trials=False, asks=begun.records.trials)
    if first[1].search.wrong_record is None and stand == begun.records.errors:  # the first search had come to its end
        return replace(first[0], records=records), first[1]
    return with_records_corrected(_again(begun, reduce(corrected, stand, logged), records), logged)


def _again(context: Context, experiment: Experiment, records: CorrectedRecords) -> Context:
    """The same from the beginning, for another `experiment`."""
    setting = context.setting
    return prepared(
        experiment, setting.cache, setting.progress, context.seed, setting.config, context.interim, records=records
    )


def leaves_little(context: Context, model: Model) -> bool:
    """Whether a model leaves no more of the fit runs than one with a wrong record may."""
    samples = float(np.asarray(context.job.problem.batch.mask).sum())
    return float(np.sqrt(model.cost / samples)) <= MOST_LEFT


def searched_finely(
    context: Context, before: tuple[JointSearch, tuple[str, ...]] | None = None
) -> tuple[Context, Outcome]:
    """The search; where the model that it ends with asks for a finer integration, on from its likeliest models with that. What comes after is begun.

    `before`: the search before a record was corrected, and the effects beside which it was wrong, from which this one begins.
    """
    setting = context.setting
    if before is None:
        outcome = Outcome(*search_by_evidence(setting, context.base))
    else:
        outcome = Outcome(*search_beside_a_record(setting, context.base, *before))
    if outcome.search.wrong_record is not None:
        return context, outcome
    finer = finer_integration(setting, outcome.final.effects, outcome.final.values, beside_what_is_left=True)
    if finer is None:
        return context, begin_ahead(context, outcome)
    given = context.job.experiment, setting.cache, setting.progress, context.seed, setting.config, context.interim
    context = prepared(*given, finer, context.records)
    context.setting.rounds += setting.rounds
    return context, begin_ahead(context, Outcome(*search_again(context.setting, context.base, outcome.search)))


def wrong_record(context: Context, outcome: Outcome) -> FoundRecordErrors | None:
    """An input of one run that was recorded wrongly; asked where something is missing, if the search has not found one."""
    setting, base, final = context.setting, outcome.base, outcome.final
    if setting.wrong_record is None:
        return None
    if outcome.search.wrong_record is not None:
        return outcome.search.wrong_record
    if not final.effects and setting.is_noise(final):
        return None
    hosts = [base, final] if final.effects else [base]
    found = record_errors(setting, hosts, final, context.job.fit_runs, trials=context.records.may_try)
    return found if found is not None and found.errors else None


def against_the_held_out_runs(context: Context, outcome: Outcome) -> tuple[Outcome, tuple[Rejected, ...]]:
    """The model that the held-out runs validate; where they reject effects, the search goes on without these.

    They say what is not named, and nothing else: what takes its place is chosen by the fit runs alone, and has to be validated as well.
    """
    job, setting = context.job, context.setting
    rejected: list[Rejected] = []
    for searches_left in reversed(range(MOST_SEARCHES)):
        final, _, now = validated(job, setting, outcome.search, outcome.base, outcome.final)
        outcome = replace(outcome, final=final)
        if now is None:
            break
        rejected.append(now)
        if searches_left:
            gone = [effect for one in rejected for effect in one.effects]
            outcome = Outcome(*search_without(setting, outcome.search, gone))
    return outcome, tuple(rejected)


def against_an_unknown_term(context: Context, outcome: Outcome) -> Outcome:
    """Evidence, where more than noise is left or many effects were added: one unknown function, or nothing at all, in their place.

    One effect that the library does not have may take several that it has, and together these may come down to the noise.
    """
    setting, base, final = context.setting, outcome.base, outcome.final
    explained = setting.is_noise(final)
    if not final.effects or (explained and len(final.effects) < setting.config.many_effects):
        return outcome
    lacking = in_place_of(setting, base, final, outcome.search.lacking)
    if lacking is not None:
        return replace(outcome, final=base, lacking=lacking, superseded=final.effects)
    # Of runs that hardly move, one alone may show what is missing: without it the others are predicted badly, and with it noise is left.
    if not explained and not setting.predicts(final.left_out_rmse):
        share = max(setting.explained_variance(final.left_out_rmse), 0.0)
        setting.set_aside(final, PredictsTooLittle(share, setting.config.least_explained_variance))
        return replace(outcome, final=base)
    return outcome


def against_an_outlier_run(context: Context, outcome: Outcome) -> Outcome:
    """Evidence, where more than noise is left: one run that does not agree with the others, in the place of the effects."""
    setting, base, final = context.setting, outcome.base, outcome.final
    if setting.is_noise(final):
        return outcome
    outcome = replace(outcome, outliers=outliers_of(context, outcome, base))
    if not final.effects:
        return outcome
    if not outcome.one_outlier:
        return replace(outcome, outliers=outliers_of(context, outcome, final) or outcome.outliers)
    setting.set_aside(final, NoiseWithoutRun(outcome.outliers[0].run))
    return replace(outcome, final=base, lacking=None)


def _provenance(experiment: Experiment, cache: ResultCache, command: str, seed: int, seconds: float) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "step": f"{experiment.step} s",
        **cache.time_taken(seconds),
        "batches of fits taken from an earlier, interrupted run": str(cache.reused),
        "sha256 of the experiment file": hashlib.sha256(experiment.path.read_bytes()).hexdigest(),
        **{f"sha256 of {run.name}": run.sha256 for run in experiment.runs},
    }
