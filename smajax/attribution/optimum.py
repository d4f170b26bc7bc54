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
from smajax.fit.priors import Priors

AS_LIKELY = 0.5  # log odds: of two models that are nearer the search's stays
SETTLED_COST = 1e-4  # of twice the log-likelihood: the optimum to within a hundredth of a standard error


def with_no_effect_too_many(search: JointSearch, found: FittedModel) -> FittedModel:
    """`found`, or the likeliest model where it is likelier once `found` without each of its effects is at its optimum: in the search such fits may have ended early."""
    left: set[tuple[str, ...]] = set()
    while found.effects not in left:
        left.add(found.effects)
        error = search.error(found)
        found = refined(search, found, error)
        without_each(search, found, found.effects, error)
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


def refined(search: JointSearch, model: FittedModel, error: float) -> FittedModel:
    """`at_optimum`, among the models that the search has fitted."""
    best = at_optimum(search, model, error)
    if best is not model:
        search.fitted[model.effects] = best
    return best


def at_optimum(
    search: JointSearch, model: FittedModel, error: float, program: Sequence[str] | None = None
) -> FittedModel:
    """A fitted model taken to its optimum, which standard errors need; `error` of an independent sample, SI.

    `program`: effects of a program that computes it, these among them; None for one of its own.
    """
    (best,) = _at_optimum(search, [model], error, model.effects if program is None else program)
    return best


def _at_optimum(
    search: JointSearch, models: Sequence[FittedModel], error: float, program: Sequence[str]
) -> list[FittedModel]:
    """The same of several models that one program computes, side by side."""
    problem, index = search.joint.restricted(program)
    problem = problem.with_noise(error)
    tasks, joints = [], []
    for model in models:
        joint = dataclasses.replace(search.joint, width_factors=model.width_factors)
        task = problem.task(model.names, joint.bounds, model.values[index])
        tasks.append(task._replace(priors=Priors.of(problem.names, joint.prior_records(model.effects))))
        joints.append(joint)
    # At a kink, as of a friction, a fit may come nearer to it by ever smaller steps, none of which any evidence or standard error shows.
    settings = dataclasses.replace(
        search.settings, stage="taking the model to its optimum", absolute_tolerance=SETTLED_COST
    )
    found = []
    for model, joint, fit in zip(models, joints, levenberg_marquardt(problem, tasks, settings), strict=True):
        values = np.array(model.values)
        values[index] = fit.values
        best = fitted_model(joint, model.effects, values, tuple(program))
        found.append(best if best.log_evidence(error**2) > model.log_evidence(error**2) else model)
    return found


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
    return without_each(search, model, (effect,), error)[effect]


def without_each(
    search: JointSearch, model: Model | FittedModel, effects: Sequence[str], error: float
) -> dict[str, FittedModel]:
    """`model` without each of `effects` in turn, at the optimum, by the effect; those that one program computes side by side."""
    joint = search.joint
    rests = {effect: joint.ordered([one for one in model.effects if one != effect]) for effect in effects}
    by_program: dict[tuple[str, ...], list[FittedModel]] = {}
    for rest in rests.values():
        if rest not in search.fitted:
            search.fitted[rest] = fitted_model(joint, rest, joint.without(model.values, rest), model.effects)
        # The model itself has a program of its own, for what is said of it later.
        program = program_compiled(search, rest, joint.ordered(model.effects))
        by_program.setdefault(program, []).append(search.fitted[rest])
    for program, models in by_program.items():
        # In the search they may have ended early.
        search.fitted |= {best.effects: best for best in _at_optimum(search, models, error, program)}
    return {effect: search.fitted[rest] for effect, rest in rests.items()}


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


def likeliest_so_far(search: JointSearch, best: FittedModel) -> tuple[JointSearch, Model, Model]:
    """(the search, base model, likeliest model) as a search that goes on has fitted them, as `search_by_evidence` gives them."""
    error = search.error(best)
    first = as_model(search, search.fitted[()], error)
    return search, first, as_model(search, best, error) if best.effects else first
