"""The main job: experiment -> check -> base fit -> residual -> search -> extended model -> findings."""

from __future__ import annotations

import hashlib
import time as clock
from pathlib import Path

import jax.numpy as jnp

from smajax.attribution.assumed import assumed, expansion_not_given, sizes_not_given
from smajax.attribution.bootstrap import bootstrapped
from smajax.attribution.confounders import rivals
from smajax.attribution.cross_validation import FORETELLS, Search
from smajax.attribution.findings import Findings, LoneRun
from smajax.attribution.found import asks_for_more, effects_found, parameters_found
from smajax.attribution.held_out import borne_out
from smajax.attribution.job import job_of
from smajax.attribution.neutral import check_neutral
from smajax.attribution.outlier_run import lone_runs
from smajax.attribution.refusal import refuse_what_only_identify_does
from smajax.attribution.search import search
from smajax.attribution.step_size_check import integration_error
from smajax.attribution.unknown_term import Lacking, in_place_of, unknown_terms
from smajax.attribution.unknown_words import told_of
from smajax.attribution.verdict import cannot_know, shown, summary, unexplained, verdict
from smajax.core.progress import Progress, Stage, as_progress, quiet, report_checks
from smajax.core.provenance import made_with
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Experiment
from smajax.fit.sensitivity import sensitivity
from smajax.fit.uncertainty import identifiability

SEED = 2004


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
    when the search is over: they refuse what they do not bear out, and nothing is added
    for them. The caller chooses precision; anything but float64 is refused with a ValueError, because the
    differences that decide here are far below float32's rounding over a run. Raises PluginError for an effect of another
    package that changes the model at its base value: every verdict would be wrong.
    """
    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError(
            "close_loop needs float64, but JAX runs in float32. Call `jax.config.update('jax_enable_x64', True)` first."
        )
    refuse_what_only_identify_does(experiment)
    check_neutral()
    began = clock.monotonic()
    progress = as_progress(progress)
    job = job_of(experiment)
    cache = ResultCache(memory)
    progress(Stage("checking what these runs can tell", 0.0))
    start = job.problem.start_values()
    setting = Search(
        job.problem,
        job.unknowns,
        job.bounds,
        job.candidates,
        cache,
        lambda value: shown(value, experiment.output_unit, experiment.output_name),
        progress,
        experiment.outputs[0].noise_given,
        job.held_out,
        apart,
    )
    at_start = sensitivity(job.problem, start, job.unknowns)
    can_tell = identifiability(at_start, job.unknowns, job.bounds)
    check = [*experiment.warnings, *can_tell]
    progress(Stage("checking what these runs can tell", 1.0))
    report_checks(progress, experiment.warnings, can_tell)

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

    final, compared, refused = borne_out(job, setting, first, final)

    progress(Stage("standard errors and pictures", 0.0))
    before = parameters_found(job, setting, first, start)
    after = parameters_found(job, setting, final, start) if final.effects else before
    intervals = bootstrapped(setting, final, seed)
    effects = effects_found(job, setting, final, after, intervals)
    mistaken = rivals(setting, final, job.fit_runs)
    runs, portrait_before, portrait_after = compared
    integration = integration_error(job, final)
    progress(Stage("standard errors and pictures", 1.0))
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
        [one.name for one in after.parameters if one.name.startswith(added) and asks_for_more(one)],
        [one for one in mistaken if one.weight > 0.5],
        sizes_not_given(job),
        [one for one in after.parameters if not one.name.startswith(added) and asks_for_more(one)],
        integration,
        lone,
        expansion_not_given(job),
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
            assumed(job),
            after.uncertainty.correlated_groups,
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
        provenance=_provenance(experiment, cache, command, seed, clock.monotonic() - began),
    )


def _provenance(experiment: Experiment, cache: ResultCache, command: str, seed: int, seconds: float) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "step": f"{experiment.step} s",
        "seconds": f"{seconds:.0f}",
        "batches of fits taken from an earlier, interrupted run": str(cache.reused),
        "sha256 of the experiment file": hashlib.sha256(experiment.path.read_bytes()).hexdigest(),
        **{f"sha256 of {run.name}": run.sha256 for run in experiment.runs},
    }
