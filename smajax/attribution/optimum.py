"""Fitted models at their optimum, and as the later stages of `close-loop` take them: in the search a fit may have ended early."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from smajax.attribution.findings import Round
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.joint_search import noted
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.leave_one_run_out import predicting
from smajax.attribution.model_fits import Model, Search, Start
from smajax.attribution.reasons import NoiseWithoutEffects
from smajax.attribution.side_by_side import program_compiled
from smajax.core.whiteness import on_samples
from smajax.fit.levenberg_marquardt import levenberg_marquardt

AS_LIKELY = 0.5  # log odds: of two models that are nearer the search's stays
SETTLED_COST = 1e-4  # of twice the log-likelihood: the optimum to within a hundredth of a standard error


def with_no_effect_too_many(search: JointSearch, found: FittedModel) -> FittedModel:
    """`found`, or the likeliest model where it is likelier once `found` without each of its effects is at its optimum: in the search such fits may have ended early."""
    left: set[tuple[str, ...]] = set()
    while found.effects not in left:
        left.add(found.effects)
        error = search.error(found)
        found = refined(search, found, error)
        for effect in found.effects:
            without(search, found, effect, error)
        best = search.best(error)
        if best.log_evidence(error**2) - found.log_evidence(error**2) > AS_LIKELY:
            found = noted(search, found, best)
    search.winner = found.effects
    return found


def with_no_effect_hardly_needed(search: JointSearch, setting: Search, found: FittedModel, error: float) -> FittedModel:
    """`found` without effects, the least needed first, as long as what is left without them is noise and the model is hardly less likely (`least_log_odds`).

    Nothing says then that they are there. Predictions are averaged with them all the same. Each is noted among the rounds.
    """
    most = found.log_evidence(error**2)
    while found.effects:
        # Those of the likeliest model have just been taken to their optimum (`with_no_effect_too_many`).
        rests = {
            effect: search.fitted.get(tuple(one for one in found.effects if one != effect))
            or without(search, found, effect, error)
            for effect in found.effects
        }
        effect, rest = max(rests.items(), key=lambda one: one[1].log_evidence(error**2))
        odds = most - rest.log_evidence(error**2)
        if odds >= setting.config.least_log_odds or not leaves_noise(setting, rest):
            break
        setting.note(Round(len(setting.rounds) + 1, (), effect, NoiseWithoutEffects(odds), removed=True))
        found = rest
    search.winner = found.effects
    return found


def leaves_noise(setting: Search, model: FittedModel) -> bool:
    """Whether what a fitted model leaves of the fit runs is noise, by the residual that it has."""
    mask = np.asarray(setting.problem.batch.mask)
    return setting.all_noise(on_samples(model.residual, mask), mask)


def refined(search: JointSearch, model: FittedModel, error: float, program: Sequence[str] | None = None) -> FittedModel:
    """`at_optimum`, among the models that the search has fitted."""
    best = at_optimum(search, model, error, program)
    if best is not model:
        search.fitted[model.effects] = best
    return best


def at_optimum(
    search: JointSearch, model: FittedModel, error: float, program: Sequence[str] | None = None
) -> FittedModel:
    """A fitted model taken to its optimum, which standard errors need; `error` of an independent sample, SI.

    `program`: effects of a program that computes it, these among them; None for one of its own.
    """
    carried = model.effects if program is None else program
    joint = dataclasses.replace(search.joint, width_factors=model.width_factors)
    problem, index = joint.restricted(carried)
    problem = problem.with_noise(error)
    task = problem.task(model.names, joint.bounds, model.values[index])
    # At a kink, as of a friction, a fit may come nearer to it by ever smaller steps, none of which any evidence or standard error shows.
    settings = dataclasses.replace(
        search.settings, stage="taking the model to its optimum", absolute_tolerance=SETTLED_COST
    )
    (fit,) = levenberg_marquardt(problem, [task], settings)
    values = np.array(model.values)
    values[index] = fit.values
    best = fitted_model(joint, model.effects, values, carried)
    return best if best.log_evidence(error**2) > model.log_evidence(error**2) else model


def final_model(search: JointSearch, setting: Search, found: FittedModel, error: float) -> Model:
    """A fitted model at its optimum by the runs alone: what is reported is no compromise with a prior.

    But of effects whose priors say how smooth a shape is (`Candidate.keeps_priors`), and of the values of presets.
    """
    best = refined(search, found, error)
    if not best.effects:
        return as_model(search, best, error)
    start = Start(best.effects, best.values)
    stage = "taking the model to the optimum of the runs"
    level = error / search.noise  # the cost counts noises here
    settled = SETTLED_COST * level**2
    enough = setting.config.final_convergence
    factors = best.width_factors
    (fit,), _ = setting.fit([start], stage, enough=enough, settled=settled, level=level, width_factors=factors)
    search.fitted.setdefault(best.effects, best)
    return as_model(search, fitted_model(search.joint, best.effects, fit.values, best.effects), error)


def without(search: JointSearch, model: Model | FittedModel, effect: str, error: float) -> FittedModel:
    """`model` without one of its effects, at the optimum."""
    rest = search.joint.ordered([one for one in model.effects if one != effect])
    fitted = search.fitted.get(rest)
    if fitted is None:
        fitted = fitted_model(search.joint, rest, search.joint.without(model.values, rest), model.effects)
        search.fitted[rest] = fitted
    # In the search it may have ended early. The model itself has a program of its own, for what is said of it later.
    return refined(search, fitted, error, program_compiled(search, rest, model.effects))


def as_model(search: JointSearch, fitted: FittedModel, error: float) -> Model:
    """A fitted model as the later stages take it, the effect that the evidence needs least at the end."""
    effects = tuple(sorted(fitted.effects, key=lambda effect: -_needed(search, effect, fitted, error)))
    return dataclasses.replace(predicting(search.joint, fitted, error, search.noise), effects=effects)


def _needed(search: JointSearch, effect: str, model: FittedModel, error: float) -> float:
    """Log evidence of `model` over the likeliest fitted one without `effect`: of its own effects, where any was fitted.

    Else half of the square by which its coefficients are off their base values, in posterior standard deviations together.
    """
    rest = tuple(name for name in model.effects if name != effect)
    if rest in search.fitted:
        return model.log_evidence(error**2) - search.fitted[rest].log_evidence(error**2)
    joint = search.joint
    own = [model.names.index(name) for name in joint.coefficients[effect]]
    off = np.asarray([joint.deviation(model.names[k], float(model.values[joint.slots[model.names[k]]])) for k in own])
    covariance = model.covariance(error**2)[np.ix_(own, own)]
    return float(0.5 * off @ np.linalg.lstsq(covariance, off, rcond=None)[0])
