"""What the stages of an attribution have found, as one record: at its end, and before it as what is known so far."""

from __future__ import annotations

from dataclasses import replace

from smajax.attribution.assumed_parameters import assumed, expansion_not_given
from smajax.attribution.averaged_prediction import Averaged, with_averages
from smajax.attribution.begun_ahead import average_of, terms_beside
from smajax.attribution.confounders import confounders
from smajax.attribution.context import Context, Outcome
from smajax.attribution.final_model_findings import effects_found, parameters_found, priors_found
from smajax.attribution.findings import Findings, Rejected, Remaining, Verdict
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.held_out import Compared, compare
from smajax.attribution.input_of_run import as_fitted
from smajax.attribution.job import effects_excluded
from smajax.attribution.model_fits import Model
from smajax.attribution.saved_model import fit_run_states, saved_model
from smajax.attribution.step_size_check import integration_error_of
from smajax.attribution.unknown.search import Lacking
from smajax.attribution.verdict import verdict_of
from smajax.core.progress import Stage

WRITING = "standard errors and pictures"


def unknown_terms_of(context: Context, outcome: Outcome, verdict: Verdict) -> tuple[Lacking, tuple[str, ...]]:
    """(unknown terms, effects that they supersede): sought where something is missing that is in all runs."""
    setting, lacking = context.setting, outcome.lacking
    if lacking is None:
        missing = verdict in (Verdict.PARTLY_EXPLAINED, Verdict.NOT_IN_LIBRARY) and not outcome.one_outlier
        lacking = terms_beside(context, outcome, outcome.final) if missing else Lacking()
    left_out = lacking.terms[0].left_out_after if lacking.terms else None
    if left_out is not None and not setting.predicts(left_out):
        return Lacking(), ()
    return lacking, outcome.superseded


def known_so_far(context: Context, models: tuple[JointSearch, Model, Model], remaining: Remaining) -> Findings:
    """What an attribution that goes on knows by then, as findings without a verdict. `models`: the search, base model, likeliest model."""
    search, base, final = models
    outcome = Outcome(search, base, final, Lacking())
    found = findings_of(context, outcome, compare(context.job, context.setting, base, final), brief=True)
    base_model, extended_model = (
        None if one is None else replace(one, unfinished=remaining.value)
        for one in (found.base_model, found.extended_model)
    )
    return replace(
        found,
        verdict=Verdict.NOT_FINISHED,
        remaining=remaining,
        base_model=base_model,
        extended_model=extended_model,
    )


def findings_of(
    context: Context, outcome: Outcome, compared: Compared, rejected: tuple[Rejected, ...] = (), brief: bool = False
) -> Findings:
    """The record of all stages. `brief`: without what takes long, the scores of effects that were not added, the confounders and the averages."""
    job, setting, experiment = context.job, context.setting, context.job.experiment
    base, final = outcome.base, outcome.final
    runs, residual_before, residual_after = compared
    setting.progress(Stage(WRITING, 0.0))
    search = outcome.search
    error_of = search.error_of
    before = parameters_found(job, setting, base, context.start, error_of(()))
    after = parameters_found(job, setting, final, context.start, error_of(final.effects)) if final.effects else before
    effects = effects_found(job, setting, final, after, search.detectable or None, search.traced, scored=not brief)
    average = Averaged()
    if len(job.fit_runs) > 1 and not brief:  # else none can be left out, which the band is made of
        average = average_of(context, outcome, final)
        runs = with_averages(runs, average.runs)
    states = {run.name: run.states for run in runs}
    extended_model = base_model = saved_model(job, setting, search, final, after, average, states)
    if final.effects:
        states = fit_run_states(job, setting, base)
        base_model = saved_model(job, setting, search, base, before, None, states)
    mistaken = () if brief else confounders(search, setting, final, job.fit_runs)
    setting.progress(Stage(WRITING, 1.0))
    verdict = verdict_of(final.effects, residual_after, setting.config)
    lacking, superseded = unknown_terms_of(context, outcome, verdict)
    return Findings(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        verdict=verdict,
        warnings=experiment.warnings,
        checks=context.checks,
        output_name=experiment.output_name,
        output_unit=experiment.output_unit,
        noise_sigma=experiment.noise_sigma,
        noise_how=experiment.noise_how,
        runs=runs,
        before=before.parameters,
        after=after.parameters,
        effects=effects,
        residual_before=residual_before,
        residual_after=residual_after,
        rounds=tuple(setting.rounds),
        explained_variance=setting.explained_variance(final.left_out_rmse),
        step=experiment.step,
        integration=integration_error_of(setting, final),
        offset=experiment.offset,
        wire=experiment.wire,
        load=experiment.load,
        declared=tuple(experiment.parameters),
        assumed=assumed(job, setting.presets),
        priors=priors_found(job, setting),
        preset_expansion=expansion_not_given(
            job, {one.name: one.value for one in after.parameters if one.name in setting.presets}
        ),
        averaged=average.models,
        dropped=average.dropped,
        correlated=after.uncertainty.correlated_groups,
        confounders=mistaken,
        superseded=superseded,
        rejected=rejected,
        record_errors=tuple(
            as_fitted(one, (after if final.effects else before).parameters) for one in context.records.errors
        ),
        unknown=lacking.terms,
        outlier_runs=outcome.outliers,
        config=setting.config,
        effects_excluded=effects_excluded(experiment),
        base_model=base_model,
        extended_model=extended_model,
    )
