"""What is asked after the search, each question once: begun by a second process when the search has ended, and answered when it is asked.

It is asked of the model that the search ends with, as a rule; of another one this process answers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from smajax.attribution.asked_ahead import ask_ahead
from smajax.attribution.averaged_prediction import Averaged, averaged
from smajax.attribution.context import Context, Outcome
from smajax.attribution.held_out import every_run
from smajax.attribution.model_fits import Model
from smajax.attribution.nuisance_grid import begin_scores
from smajax.attribution.outlier_run import LEAVING_OUT, outlier_runs
from smajax.attribution.record_error import OutlierRun
from smajax.attribution.unknown.search import Lacking, unknown_terms
from smajax.attribution.unknown.term_fits import FITTING_TERMS


class _Question(NamedTuple):
    """A function of the search's settings and of these arguments; the stage that is shown while this process waits for it."""

    stage: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


def _without_runs(context: Context, outcome: Outcome, model: Model) -> _Question:
    return _Question(LEAVING_OUT, outlier_runs, (model, [run.name for run in context.job.fit_runs]))


def _with_terms(context: Context, outcome: Outcome, model: Model) -> _Question:
    return _Question(FITTING_TERMS, unknown_terms, (model,))


def _on_average(context: Context, outcome: Outcome, model: Model) -> _Question:
    clocks = {run.name: len(run.time) for run in context.job.experiment.runs}
    of_search = outcome.search.alone(), model, every_run(context.job), outcome.base, clocks
    return _Question("averaging the likely models", averaged, of_search)


Asks = Callable[[Context, Outcome, Model], _Question]


def begin_ahead(context: Context, outcome: Outcome) -> Outcome:
    """`outcome` with what a second process, where there is one, may have done by the time when it is asked, where the model leaves more than noise."""
    base, final = outcome.base, outcome.final
    if outcome.search.wrong_record is not None or context.setting.is_noise(final):
        return outcome
    of_final = [(_without_runs, final)] if final.effects else []
    return _begun(context, outcome, [(_without_runs, base), *of_final, (_with_terms, final)])


def begin_findings(context: Context, outcome: Outcome) -> Outcome:
    """The same of what is asked in the end, whatever the model leaves; once no record is corrected any more."""
    search, final = outcome.search, outcome.final
    begin_scores(context.setting, final.effects, context.job.candidates, search.detectable or None, search.traced)
    return _begun(context, outcome, [(_on_average, final)]) if len(context.job.fit_runs) > 1 else outcome


def _begun(context: Context, outcome: Outcome, questions: Sequence[tuple[Asks, Model]]) -> Outcome:
    asked = list(outcome.asked)
    for asks, model in questions:
        stage, function, arguments = asks(context, outcome, model)
        asked.append((asks, model, ask_ahead(stage, context.setting, function, *arguments)))
    return replace(outcome, asked=tuple(asked))


def _answer(asks: Asks, context: Context, outcome: Outcome, model: Model) -> Any:
    for asked, begun_of, answer in outcome.asked:
        if asked is asks and begun_of is model:
            return answer.result()
    _, function, arguments = asks(context, outcome, model)
    return function(context.setting, *arguments)


def outliers_of(context: Context, outcome: Outcome, model: Model) -> tuple[OutlierRun, ...]:
    """`outlier_runs` of a model."""
    found: tuple[OutlierRun, ...] = _answer(_without_runs, context, outcome, model)
    return found


def terms_beside(context: Context, outcome: Outcome, model: Model) -> Lacking:
    """`unknown_terms` beside a model."""
    found: Lacking = _answer(_with_terms, context, outcome, model)
    return found


def average_of(context: Context, outcome: Outcome, model: Model) -> Averaged:
    """`averaged`, every run by the likely models where `model` is the likeliest."""
    found: Averaged = _answer(_on_average, context, outcome, model)
    return found
