"""Models with one unknown term each, fitted: what the search of an unknown term compares."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, fitted_model, independent_error
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.program_fits import BegunFit, comparison_settings, fits_by_program
from smajax.attribution.score_test import Score, ranked, without
from smajax.attribution.unknown.ranges import Sought, sought
from smajax.attribution.unknown.terms import UNKNOWN, ForceOfSpeed
from smajax.core.parameters import parameters
from smajax.core.progress import Stage
from smajax.data.experiment.record import Prior
from smajax.fit.integration import limited_near, with_integration
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.fit.outputs_of_runs import made_ready
from smajax.fit.sensitivity import sensitivity
from smajax.fit.starts import nearest
from smajax.model.effects.candidate import PRIOR_ODDS
from smajax.model.effects.prior_width import CoefficientPrior

FITTING_TERMS = "fitting unknown terms"
INDISTINGUISHABLE = 3.0  # in log odds: twenty to one
# Of the likeliest's log odds over no term: eleven waves leave about a hundredth of a function, and in which equation they leave
# less of it says nothing.
APPROXIMATE = 0.01
PASSES = 2  # the error of a sample is first that of the model without a term, then that of the best with one
# Size of a wave for the score test, which has no prior, and for a fit, in which the prior holds it: a strain of the square of the fraction needs three.
USUAL, LARGEST = 2.0, 4.0
MUCH = 1e4  # samples times directions of the derivative, of one fit
AS_MUCH = 0.9  # of the gain of the best of an equation: another of it is fitted too
AS_NOISE = 0.9  # of residuals that have nothing to do with a term would give it more: beyond that it is not fitted
# Of the squares that are left, no value of the parameters would take away: beyond that their priors hardly hold them.
HARDLY_HELD = 0.5
TINY = 1e-300
TOGETHER = 3  # terms in a program, which computes mostly the model that they are all beside
FEW_LIKELY = 2  # effects that a program of the terms carries for later: each makes its runs slower now
REACH = 10.0  # in log odds behind the likeliest, within which a term is fitted again with the smaller error


def with_terms(
    setting: Search, final: Model | FittedModel, carried: Sequence[str] = ()
) -> tuple[Search, np.ndarray, Sought]:
    """(search among the terms that the runs can show, the final model's values in its order, what is sought).

    One model carries them all, so that one compiled program serves the screening, every fit and every left-out run. `carried`: effects that it has as well, off.
    """
    # Where the runs go and how many tries they take is asked of the final model alone, whose program is there.
    alone, index = setting.restricted(final.effects)
    there = final.values[index]
    found = sought(alone.system_at(jnp.asarray(there)), alone.with_own_values(there))
    integration = limited_near(alone, there)
    plain, index = setting.restricted((*final.effects, *carried))
    system = plain.system_at(jnp.asarray(final.values[index]))
    names = tuple(term.effect_name for term in found.terms)
    whole = dataclasses.replace(system, effects=(*system.effects, *found.terms))
    own = [name for name in parameters(whole) if name.split(".")[0] in names]
    known = {name: Prior(0.0, setting.config.term_prior_sigma, False) for name in own}
    known |= setting.prior_records(presets=False)
    own_values = dataclasses.replace(plain.per_run, start=plain.per_run_at(jnp.asarray(final.values[index])))
    # A force that grows with speed lets a load shake: a trial point then takes a hundred times as long as any that a fit ends at.
    problem = with_integration(plain, integration)
    problem = problem.with_system(whole, per_run=own_values, priors=known)
    bounds = {**setting.bounds, **dict.fromkeys(own, (-LARGEST, LARGEST))}
    unknowns = tuple(setting.free(final.effects))
    search = Search(
        problem,
        unknowns,
        bounds,
        names,
        setting.cache,
        setting.progress,
        setting.noise_given,
        setting.noises_given,
        setting.held_out,
        config=setting.config,
        of_unknowns=setting.of_unknowns,
        held_out_runs=setting.held_out_runs,
    )
    return search, problem.start_values(), found


def screened(setting: Search, values: np.ndarray) -> tuple[list[Score], float]:
    """(every term's score test at the final model, best first; the share of the squares left there that no value of the parameters would take away)."""
    at = sensitivity(setting.problem, values, setting.every)
    loose = setting.loose((), values)
    whole, beside = at.residual(), without(at, loose)[1]
    share = float(beside @ beside) / max(float(whole @ whole), TINY)
    bounds = {**setting.bounds, **{name: (-USUAL, USUAL) for name in setting.every if name.split(".")[0] in UNKNOWN}}
    return ranked(at, loose, setting.candidates, bounds), share


def _gains_as_of_noise(score: Score, squares: float) -> bool:
    """Whether `AS_NOISE` of residuals like this one that have nothing to do with a term would give it more; `squares` left beside the parameters, over that of an independent sample."""
    return float(scipy.stats.chi2.sf(score.gain * squares, len(score.coefficients))) > AS_NOISE


def _best_of_each(scores: Sequence[Score], count: int, squares: float) -> list[Score]:
    """The best of each equation, then the others by gain, `count` of them, without those that gain as of noise; the best alone if all gain so little.

    Beside these `count` those of an equation that gain nearly as much as its best: about the base model a change of the command and one of the resistance look much
    the same, and fitted only one of them comes to the noise. `squares`: as of `_gains_as_of_noise`.
    """
    firsts: dict[str, Score] = {}
    for score in scores:
        firsts.setdefault(UNKNOWN[score.effects[0]].candidate.equation, score)
    leading = list(firsts.values())
    rest = [score for score in scores if score not in leading]
    alike = [one for one in rest if one.gain > AS_MUCH * firsts[UNKNOWN[one.effects[0]].candidate.equation].gain]
    chosen = dict.fromkeys(one.effects[0] for one in [*[*leading, *rest][:count], *alike])
    found = [score for score in scores if score.effects[0] in chosen and score.gain > 0.0]
    return [score for score in found if not _gains_as_of_noise(score, squares)] or found[:1]


@dataclass(frozen=True)
class TermFits:
    """Models of one base with one of the terms each, fitted; likeliest first."""

    search: Search
    sought: Sought
    joint: JointParameters
    none: FittedModel  # the base without a term
    fitted: tuple[FittedModel, ...]
    gains: Mapping[str, float]  # of the score test, by term
    programs: Mapping[str, tuple[str, ...]]  # effects and terms of the program that each term was fitted in

    def log_odds(self, model: FittedModel, error: float) -> float:
        """Of a model with a term over the one without."""
        return model.log_evidence(error**2) - self.none.log_evidence(error**2)


def fits_with_terms(setting: Search, final: Model | FittedModel, likely: Sequence[str] = ()) -> TermFits | None:
    """The terms that promise most, each fitted beside `final`; those that are `REACH` behind the likeliest are left out.

    None where none promises anything. `likely`: effects beside which terms are likely to be asked for as well: the program that screens them carries a few of these, and is there then.
    """
    carried = tuple(likely) if len(likely) <= FEW_LIKELY else ()
    search, values, found = with_terms(setting, final, carried)
    if not search.candidates:
        return None
    search.progress(Stage("looking for the equation that lacks something", 0.0))
    scores, share = screened(search, values)
    joint = joint_with_terms(setting, search, (*final.effects, *carried))
    none = fitted_model(joint, final.effects, values, tuple(joint.coefficients))
    error = least_error(setting, [none])
    # Where priors hold parameters off what the runs ask of them, a score test says little of a fit.
    squares = share * none.squares / error**2 if share > HARDLY_HELD else math.inf
    chosen = _best_of_each(scores, setting.config.terms_refitted, squares)
    search.progress(Stage("looking for the equation that lacks something", 1.0))
    if not chosen:
        return None
    places = first_places(search, joint, chosen, values)
    programs = programs_of_terms(joint, final.effects, list(places))
    fitted: list[FittedModel] = []
    for _ in range(PASSES):
        fitted = fitted_terms(search, joint, final.effects, programs, places, error)
        error = least_error(setting, [none, *fitted])
        fitted.sort(key=lambda model: -model.log_evidence(error**2))
        best = fitted[0].log_evidence(error**2)
        least = best - max(REACH, APPROXIMATE * (best - none.log_evidence(error**2)))
        fitted = [one for one in fitted if one.log_evidence(error**2) >= least]
        if best < none.log_evidence(error**2) - INDISTINGUISHABLE:
            break
        places = {one.effects[-1]: [one.values] for one in fitted}
    gains = {score.effects[0]: score.gain for score in scores}
    program_of = {term: own for own, terms in programs for term in terms}
    return TermFits(search, found, joint, none, tuple(fitted), gains, program_of)


def joint_with_terms(setting: Search, search: Search, effects: Sequence[str]) -> JointParameters:
    """Parameters of models with some of `effects` and one of the terms of `search`, with their priors."""
    plain = setting.joint(effects)
    own = {term: tuple(search.coefficients(term)) for term in search.candidates}
    width = CoefficientPrior(0.0, setting.config.term_prior_sigma, False)
    return JointParameters(
        search.problem,
        plain.unknowns,
        search.bounds,
        {**plain.coefficients, **own},
        {**plain.priors, **{name: width for names in own.values() for name in names}},
        {**plain.log_odds, **dict.fromkeys(own, math.log(PRIOR_ODDS["event"]))},
    )


def least_error(setting: Search, models: Sequence[FittedModel]) -> float:
    """What an independent sample may be off by, SI, given what the best of `models` leaves: all are compared with that."""
    best = min(models, key=lambda model: model.rms)
    return independent_error(best, float(setting.problem.noise_sigma), setting.noise_given)


def first_places(
    search: Search, joint: JointParameters, chosen: Sequence[Score], values: np.ndarray
) -> dict[str, list[np.ndarray]]:
    """Where fits of each chosen term begin, parameters (P,).

    At zero, where a fit cannot end worse than the model without it, and some way towards what the score test says, because a
    run whose transformation begins elsewhere lies in another local minimum.
    """
    config, places = search.config, {}
    for score in chosen:
        ahead = np.array(values)
        for name, size in score.coefficients.items():
            ahead[joint.slots[name]] = np.clip(
                config.term_start_share * size, -config.term_start_limit, config.term_start_limit
            )
        places[score.effects[0]] = [values, ahead]
    return places


def fitted_terms(
    search: Search,
    joint: JointParameters,
    effects: tuple[str, ...],
    among: Sequence[tuple[tuple[str, ...], Sequence[str]]],
    places: Mapping[str, Sequence[np.ndarray]],
    error: float,
) -> list[FittedModel]:
    """Every term of `places` fitted together with the parameters of the model with `effects`, from the best of its places, in its program `among` those of all."""
    settings = comparison_settings(FitSettings(cache=search.cache, progress=search.progress), FITTING_TERMS)
    groups = []
    own = [(program, [term for term in terms if term in places]) for program, terms in among]
    programs = [(program, terms, *joint.restricted(program)) for program, terms in own if terms]
    made_ready([problem for _, _, problem, _ in programs])
    for program, terms, problem, index in programs:
        begun = nearest(problem.with_noise(error), [places[term] for term in terms], index)
        groups.append((program, [BegunFit((*effects, term), at) for term, at in zip(terms, begun, strict=True)]))
    fits = fits_by_program(joint, groups, error, settings)
    return [fitted_model(joint, one, values, program) for one, program, values, _ in fits]


def programs_of_terms(
    joint: JointParameters, effects: tuple[str, ...], terms: Sequence[str]
) -> list[tuple[tuple[str, ...], list[str]]]:
    """(effects and terms that a program carries, terms that are fitted in it).

    The program of all terms is there, from the screening. A run of it computes all of them, and takes six times as long as one of a
    single term; where there is something to compute, one for each few terms is soon worth its second. A force that depends on the speed has one for itself: with it a load may swing, and each run beside it would take as many steps.
    """
    directions = max(len(joint.free((*effects, term))) for term in terms)
    if directions * float(np.asarray(joint.problem.batch.mask).sum()) < MUCH:
        return [(tuple(joint.coefficients), list(terms))]
    alone = [term for term in terms if UNKNOWN[term].state == ForceOfSpeed.state]
    others = [term for term in terms if term not in alone]
    groups = [others[first : first + TOGETHER] for first in range(0, len(others), TOGETHER)]
    return [((*effects, *group), group) for group in [*groups, *([one] for one in alone)]]
