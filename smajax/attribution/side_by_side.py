"""Fits of sets of effects in a joint search, side by side by program, and into what it has fitted."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from smajax.attribution.fit_programs import Effects, compiled_for, grouped, samples_of
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel
from smajax.attribution.program_fits import MOST_WIDENED, BegunFit, comparison_settings, models_by_program
from smajax.core.progress import Stage

LOOSELY = 2.0  # times the present error, at which a set was fitted that is fitted on before others are held against it


def fit_side_by_side(
    search: JointSearch,
    begun: Sequence[BegunFit],
    error: float,
    stage: str,
    compared: bool = True,
    least_cost: float = np.inf,
) -> None:
    """Fit sets of effects, those of one program side by side; the better of two fits of one set counts.

    `compared`: those that fall far behind the others, or `least_cost` (of another model at this error), end early, and of several of one set all but the best.
    """
    joint = search.joint
    search.settings.progress(Stage(stage, 0.0))
    settings = dataclasses.replace(comparison_settings(search.settings, stage), least_cost=least_cost)
    if not compared:
        settings = dataclasses.replace(settings, allowed_excess=(), promised_excess=None, one_of_each=0)
    groups = [
        (program, [one for one in begun if one.effects in its_sets])
        for program, its_sets in grouped_sets(search, [one.effects for one in begun])
    ]
    search.trials |= {one.effects: error for one in begun}
    for model in models_by_program(joint, groups, error, settings, MOST_WIDENED if compared else 0):
        old = search.fitted.get(model.effects)
        if old is None or model.log_evidence(error**2) > old.log_evidence(error**2):
            search.fitted[model.effects] = model


def grouped_sets(
    search: JointSearch, sets: Iterable[tuple[str, ...]]
) -> list[tuple[tuple[str, ...], list[tuple[str, ...]]]]:
    """(effects that a program carries, sets that are fitted in it), and remember the programs."""
    found = []
    for union, its_sets in grouped(sets, search.programs, samples_of(search.joint.problem)):
        program = search.joint.ordered(tuple(union))
        search.programs = tuple(dict.fromkeys([*search.programs, program]))
        found.append((program, its_sets))
    return found


def program_compiled(search: JointSearch, effects: Effects, *more: Effects) -> Effects:
    """The program in which a set of effects is fitted: one of those compiled, of which `more` are some, or its own where that takes less time."""
    # What an earlier search carried may be in the base model since.
    programs = [search.joint.ordered(one) for one in (*search.programs, *more)]
    return compiled_for(effects, programs, samples_of(search.joint.problem))


def fitted_from(search: JointSearch, model: FittedModel) -> FittedModel:
    """The effects of `model`, fitted with every free parameter of `search` from its values; `model` where that fit has no number."""
    return _to_its_end(search, model, search.error(model), "fitting with the values of presets free")


def fit_continued(search: JointSearch, model: FittedModel, error: float, stage: str) -> FittedModel:
    """`model` fitted on where its fit ended at an error of a sample of more than `LOOSELY` times `error`, beside which its last steps were nothing; SI.

    Any set that is fitted anew at the smaller error would be likelier than it by what it still had to come to.
    """
    while search.trials.get(model.effects, 0.0) > LOOSELY * error:
        model = _to_its_end(search, model, error, stage)
        error = search.error(model)
    return model


def _to_its_end(search: JointSearch, model: FittedModel, error: float, stage: str) -> FittedModel:
    """The effects of `model` fitted from its values at this error of a sample, SI."""
    begun = BegunFit(model.effects, model.values, model.width_factors)
    fit_side_by_side(search, [begun], error, stage, compared=False)
    return search.fitted.get(model.effects, model)
