"""What is asked after the search, begun by a second process as soon as the search has ended: it is asked of the model that the search ends with, as a rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from smajax.attribution.averaged_prediction import averaged
from smajax.attribution.context import Context, Outcome
from smajax.attribution.held_out import every_run
from smajax.attribution.model_fits import Model
from smajax.attribution.outlier_run import outlier_runs
from smajax.attribution.unknown.search import unknown_terms
from smajax.core.worker_process import begin_call

OUTLIERS_OF_BASE, OUTLIERS = "outlier runs of the base model", "outlier runs"
UNKNOWN_TERMS, AVERAGED = "unknown terms", "average of the likely models"


def begin_ahead(context: Context, outcome: Outcome) -> Outcome:
    """`outcome` with what a second process, where there is one, may have done by the time when it is asked."""
    setting, search, base, final = context.setting, outcome.search, outcome.base, outcome.final
    if search.wrong_record is not None:
        return outcome
    alone, names = setting.alone(), [run.name for run in context.job.fit_runs]
    calls: dict[str, tuple[Model, Callable[..., Any], tuple[Any, ...]]] = {}
    if not setting.is_noise(final):
        calls[OUTLIERS_OF_BASE] = base, outlier_runs, (alone, base, names)
        if final.effects:
            calls[OUTLIERS] = final, outlier_runs, (alone, final, names)
        calls[UNKNOWN_TERMS] = final, unknown_terms, (alone, final)
    if len(context.job.fit_runs) > 1:
        clocks = {run.name: len(run.time) for run in context.job.experiment.runs}
        calls[AVERAGED] = final, averaged, (alone, search.alone(), final, every_run(context.job), base, clocks)
    return replace(
        outcome,
        calls={
            what: (model, begin_call(partial(function, setting, *own[1:]), function, *own))
            for what, (model, function, own) in calls.items()
        },
    )
