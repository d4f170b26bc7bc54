"""What is asked after the search, begun by a second process as soon as the search has ended: it is asked of the model that the search ends with, as a rule."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from smajax.attribution.asked_ahead import AskedAhead, ask_ahead
from smajax.attribution.averaged_prediction import averaged
from smajax.attribution.context import Context, Outcome
from smajax.attribution.held_out import every_run
from smajax.attribution.model_fits import Model
from smajax.attribution.outlier_run import LEAVING_OUT, outlier_runs
from smajax.attribution.unknown.search import unknown_terms
from smajax.attribution.unknown.term_fits import FITTING_TERMS

OUTLIERS_OF_BASE, OUTLIERS = "outlier runs of the base model", "outlier runs"
AVERAGING = "averaging the likely models"
UNKNOWN_TERMS, AVERAGED = "unknown terms", "average of the likely models"


def begin_ahead(context: Context, outcome: Outcome) -> Outcome:
    """`outcome` with what a second process, where there is one, may have done by the time when it is asked."""
    setting, search, base, final = context.setting, outcome.search, outcome.base, outcome.final
    if search.wrong_record is not None:
        return outcome
    names = [run.name for run in context.job.fit_runs]
    asked: dict[str, tuple[Model, AskedAhead[Any]]] = {}
    if not setting.is_noise(final):
        asked[OUTLIERS_OF_BASE] = base, ask_ahead(LEAVING_OUT, setting, outlier_runs, base, names)
        if final.effects:
            asked[OUTLIERS] = final, ask_ahead(LEAVING_OUT, setting, outlier_runs, final, names)
        asked[UNKNOWN_TERMS] = final, ask_ahead(FITTING_TERMS, setting, unknown_terms, final)
    if len(context.job.fit_runs) > 1:
        clocks = {run.name: len(run.time) for run in context.job.experiment.runs}
        of_search = search.alone(), final, every_run(context.job), base, clocks
        asked[AVERAGED] = final, ask_ahead(AVERAGING, setting, averaged, *of_search)
    return replace(outcome, asked=asked)
