"""Where something is missing that no effect of the library accounts for: an unknown term in each equation in turn.

Each term (`smajax.attribution.unknown.terms`) is a smooth function of one state. All are screened by the score test at the final
model of the search; the best of each equation are fitted together with the model's parameters and compared by their evidence, as
sets of effects are. The held-out runs can reject the likeliest. What is learnt is a function: drawn over the states that the runs
went through, and compared with simple formulas.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.attribution.findings import UnknownTerm, UnknownTermLikelier
from smajax.attribution.formulas import formulas
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.joint_search import comparison_settings, fits_by_program
from smajax.attribution.laplace_evidence import FittedModel, fitted_model, independent_error
from smajax.attribution.leave_one_run_out import predicting
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.paired_errors import compared, pooled_rms
from smajax.attribution.score_test import Score, ranked
from smajax.attribution.unknown.explained_share import EXPLAINED
from smajax.attribution.unknown.ranges import Sought, sought
from smajax.attribution.unknown.spline import design
from smajax.attribution.unknown.terms import UNKNOWN
from smajax.attribution.values_per_run import held_out_owners, held_out_residuals
from smajax.core.parameters import parameters
from smajax.core.progress import Stage
from smajax.core.whiteness import correlation_time, split_runs
from smajax.data.experiment.record import Prior
from smajax.fit.levenberg_marquardt import FitSettings
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.starts import nearest
from smajax.fit.uncertainty import covariance_of, uncertainty
from smajax.model.effects.candidate import PRIOR_ODDS
from smajax.model.effects.prior_width import CoefficientPrior

INDISTINGUISHABLE = 3.0  # in log odds: twenty to one
# Of the likeliest's log odds over no term: seven splines leave about a hundredth of a function, and in which equation they leave
# less of it says nothing.
APPROXIMATE = 0.01
PASSES = 2  # the error of a sample is first that of the model without a term, then that of the best with one
MUCH = 7e4  # samples times directions of the derivative, of one fit
REACH = 10.0  # in log odds behind the likeliest, within which a term is fitted again with the smaller error


def with_terms(setting: Search, final: Model) -> tuple[Search, np.ndarray, Sought]:
    """(search among the terms that the runs can show, the final model's values in its order, what is sought).

    One model carries them all, so that one compiled program serves the screening, every fit and every left-out run.
    """
    plain, index = setting.restricted(final.effects)
    system = plain.system_at(jnp.asarray(final.values[index]))
    found = sought(system, plain.with_own_values(final.values[index]))
    names = tuple(term.effect_name for term in found.terms)
    whole = dataclasses.replace(system, effects=(*system.effects, *found.terms))
    own = [name for name in parameters(whole) if name.split(".")[0] in names]
    known = {name: Prior(0.0, setting.config.term_prior_sigma, False) for name in own}
    known |= setting.prior_records(presets=False)
    own_values = dataclasses.replace(plain.per_run, start=plain.per_run_at(jnp.asarray(final.values[index])))
    problem = plain.with_system(whole, per_run=own_values, priors=known)
    bounds = {**setting.bounds, **dict.fromkeys(own, (-1.0, 1.0))}
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


def screened(setting: Search, values: np.ndarray) -> list[Score]:
    """Every term's score test at the final model, best first."""
    at = sensitivity(setting.problem, values, setting.every)
    return ranked(at, setting.loose((), values), setting.candidates, setting.bounds)


def _best_of_each(scores: Sequence[Score], count: int) -> list[Score]:
    """The best of each equation first, then the others by gain; `count` of them that promise anything."""
    firsts: dict[str, Score] = {}
    for score in scores:
        firsts.setdefault(UNKNOWN[score.effects[0]].candidate.equation, score)
    leading = list(firsts.values())
    rest = [score for score in scores if score not in leading]
    return [score for score in [*leading, *rest][:count] if score.gain > 0.0]


@dataclass(frozen=True)
class Lacking:
    """What was learnt of each term that was fitted, likeliest first; the first as it was fitted if it is named."""

    terms: tuple[UnknownTerm, ...] = ()
    likeliest: FittedModel | None = None


@dataclass(frozen=True)
class TermFits:
    """Models of one base with one of the terms each, fitted; likeliest first."""

    search: Search
    sought: Sought
    joint: JointParameters
    none: FittedModel  # the base without a term
    fitted: tuple[FittedModel, ...]
    gains: Mapping[str, float]  # of the score test, by term

    def log_odds(self, model: FittedModel, error: float) -> float:
        """Of a model with a term over the one without."""
        return model.log_evidence(error**2) - self.none.log_evidence(error**2)


def fits_with_terms(setting: Search, final: Model) -> TermFits | None:
    """The terms that promise most, each fitted beside `final`; those that are `REACH` behind the likeliest are left out.

    None where none promises anything.
    """
    search, values, found = with_terms(setting, final)
    if not search.candidates:
        return None
    search.progress(Stage("looking for the equation that lacks something", 0.0))
    scores = screened(search, values)
    chosen = _best_of_each(scores, setting.config.terms_refitted)
    search.progress(Stage("looking for the equation that lacks something", 1.0))
    if not chosen:
        return None
    joint = joint_with_terms(setting, search, final)
    none = fitted_model(joint, final.effects, values, tuple(joint.coefficients))
    error = least_error(setting, [none])
    places = first_places(search, joint, chosen, values)
    fitted: list[FittedModel] = []
    for _ in range(PASSES):
        fitted = fitted_terms(search, joint, final.effects, places, error)
        error = least_error(setting, [none, *fitted])
        fitted.sort(key=lambda model: -model.log_evidence(error**2))
        best = fitted[0].log_evidence(error**2)
        least = best - max(REACH, APPROXIMATE * (best - none.log_evidence(error**2)))
        fitted = [one for one in fitted if one.log_evidence(error**2) >= least]
        places = {one.effects[-1]: [one.values] for one in fitted}
    gains = {score.effects[0]: score.gain for score in scores}
    return TermFits(search, found, joint, none, tuple(fitted), gains)


def unknown_terms(setting: Search, final: Model) -> Lacking:
    """An unknown term in each equation in turn, beside `final`.

    The likeliest is `named` where it is likelier than none, explains `EXPLAINED` of what is missing in runs left out, and predicts held-out runs better too. Terms
    that are likelier than none and less than `INDISTINGUISHABLE`, or `APPROXIMATE` of its log odds, behind it stand in `indistinguishable`.
    """
    fits = fits_with_terms(setting, final)
    return Lacking() if fits is None else learnt(setting, fits)


def learnt(setting: Search, fits: TermFits) -> Lacking:
    """What the fitted terms say, and whether the likeliest is named."""
    search, fitted = fits.search, fits.fitted
    error = least_error(setting, [fits.none, *fitted])
    noise = float(search.problem.noise_sigma)
    programs = _programs(fits.joint, fits.none.effects, [model.effects[-1] for model in fitted])
    program_of = {term: own for own, terms in programs for term in terms}
    present = predicting(fits.joint, fits.none, error, noise, next(iter(program_of.values())))
    log_odds = [fits.log_odds(one, error) for one in fitted]
    likeliest = fitted[0]
    least = max(0.0, log_odds[0] - max(INDISTINGUISHABLE, APPROXIMATE * log_odds[0]))
    alike = [model.effects[-1] for model, odds in zip(fitted[1:], log_odds[1:], strict=True) if odds > least]
    # The runs are left out of what is named, or may be in its place: refits take as long as the fits.
    predict = {
        model.effects[-1]: predicting(fits.joint, model, error, noise, program_of[model.effects[-1]]).left_out_rmse
        for model in fitted
        if model is likeliest or model.effects[-1] in alike
    }
    # One run fits too well to name anything: there is none to predict.
    several = search.problem.batch.runs > 1
    enough = log_odds[0] > 0.0 and several
    enough = enough and _explains(predict[likeliest.effects[-1]], present.left_out_rmse, noise)
    held_out = None
    if enough and search.held_out is not None:
        both = [present.values, likeliest.values]
        without, with_it = held_out_residuals(search, search.candidates, both)
        held_out = pooled_rms(without), pooled_rms(with_it)
        enough = compared(with_it, without, setting.config, held_out_owners(search)) != "worse"
    terms: list[UnknownTerm] = []
    for model, odds in zip(fitted, log_odds, strict=True):
        left_out = present.left_out_rmse, predict.get(model.effects[-1]) if several else None
        term = _learnt(search, fits.sought, model, left_out, fits.gains[model.effects[-1]], odds)
        if not terms:
            before, after = held_out if held_out is not None else (None, None)
            term = dataclasses.replace(
                term,
                named=enough,
                indistinguishable=tuple(alike) if enough else (),
                held_out_before=before,
                held_out_after=after,
            )
        terms.append(term)
    return Lacking(tuple(terms), likeliest if enough else None)


def _less(with_it: float | None, without: float) -> bool:
    return with_it is not None and with_it < without


def _explains(with_it: float, without: float, noise: float) -> bool:
    """Whether a function takes away `EXPLAINED` of the squares that the error on runs left out has beyond the noise (`explained_share`); root mean squares, SI."""
    return _less(with_it, without) and with_it**2 - noise**2 <= (1.0 - EXPLAINED) * (without**2 - noise**2)


def joint_with_terms(setting: Search, search: Search, final: Model) -> JointParameters:
    """Parameters of models with the effects of `final` and one of the terms of `search`, with their priors."""
    plain = setting.joint(final.effects)
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


def in_place_of(setting: Search, first: Model, final: Model) -> Lacking | None:
    """One unknown term in the base model `first` that is likelier than the base model with all the effects of `final`.

    Then these are what the library has that comes near it, and none of them is missing: a round is noted in which they are
    removed. So too where the term explains too little to be named, and they explain less and are far behind.
    """
    fits = fits_with_terms(setting, first)
    if fits is None:
        return None
    joint = setting.joint(setting.candidates)
    effects = fitted_model(joint, final.effects, final.values, final.effects)
    error = least_error(setting, [effects, *fits.fitted])
    ahead = max(one.log_evidence(error**2) for one in fits.fitted) - effects.log_evidence(error**2)
    if ahead <= 0.0:
        return None
    found = learnt(setting, fits)
    best = found.terms[0]
    little = ahead > INDISTINGUISHABLE and best.log_odds > 0.0 and best.held_out_before is None
    little = little and _less(best.left_out_after, min(best.left_out_before, final.left_out_rmse))
    if found.likeliest is None and not little:
        return None
    setting.set_aside(final, UnknownTermLikelier(found.terms[0].title, ahead))
    return found


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
    places: Mapping[str, Sequence[np.ndarray]],
    error: float,
) -> list[FittedModel]:
    """Every term fitted together with the parameters of the model with `effects`, from the best of its places."""
    settings = comparison_settings(FitSettings(cache=search.cache, progress=search.progress), "fitting unknown terms")
    groups = []
    for program, terms in _programs(joint, effects, list(places)):
        problem, index = joint.restricted(program)
        begun = nearest(problem.with_noise(error), [places[term] for term in terms], index)
        groups.append((program, [((*effects, term), at) for term, at in zip(terms, begun, strict=True)]))
    fits = fits_by_program(joint, groups, error, settings)
    return [fitted_model(joint, own, values, program) for own, program, values, _ in fits]


def _programs(
    joint: JointParameters, effects: tuple[str, ...], terms: Sequence[str]
) -> list[tuple[tuple[str, ...], list[str]]]:
    """(effects and terms that a program carries, terms that are fitted in it).

    The program of all terms is there, from the screening. A run of it computes all of them; where there is much to compute, one
    for each term is soon worth its three seconds.
    """
    directions = max(len(joint.free((*effects, term))) for term in terms)
    if directions * float(np.asarray(joint.problem.batch.mask).sum()) < MUCH:
        return [(tuple(joint.coefficients), list(terms))]
    return [((*effects, term), [term]) for term in terms]


def _learnt(
    search: Search,
    found: Sought,
    model: FittedModel,
    left_out: tuple[float, float | None],
    gain: float,
    log_odds: float,
) -> UnknownTerm:
    """The function, its band, where the runs went, and formulas for it."""
    term = next(one for one in found.terms if one.effect_name == model.effects[-1])
    own = search.coefficients(term.effect_name)
    others = search.free(())
    at = model.values[[search.problem.names.index(name) for name in own]]
    scale, low, width = float(term.scale), float(term.low), float(term.width)
    share = np.clip((found.states[term.effect_name] - low) / width, 0.0, 1.0)
    # About the mean over the samples, where a constant changes nothing.
    centre = design(share).mean(axis=0) if term.only_changes else np.zeros(len(own))
    grid = np.linspace(0.0, 1.0, search.config.term_points)
    basis = design(grid) - centre
    sensitive = sensitivity(search.problem, model.values, [*others, *own])
    covariance, held_ones = (
        _covariance(search, sensitive, model.values, own, names) * scale**2 for names in ((*others, *own), own)
    )
    error, error_held = (
        np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, one, basis), 0.0)) for one in (covariance, held_ones)
    )
    counts = np.histogram(share, search.config.term_bins, (0.0, 1.0))[0]
    mask = np.asarray(search.problem.batch.mask)
    misfit = misfits(search.problem, [model.values])[0]
    samples = float(mask.sum()) / correlation_time(split_runs(misfit, mask))
    reading = search.problem.system.load.reading[1]
    state_unit, unit = (reading if one == "reading" else one for one in (term.state_unit, term.unit))
    return UnknownTerm(
        name=term.effect_name,
        title=term.candidate.title,
        equation=term.candidate.equation,
        symbol=term.symbol,
        state=term.state,
        state_unit=state_unit,
        unit=unit,
        named=False,
        indistinguishable=(),
        log_odds=log_odds,
        score_gain=gain,
        left_out_before=left_out[0],
        left_out_after=left_out[1],
        held_out_before=None,
        held_out_after=None,
        at=low + width * grid,
        values=scale * basis @ at,
        error=error,
        error_held=error_held,
        cells=low + width * np.linspace(0.0, 1.0, search.config.term_bins + 1),
        samples=counts,
        formulas=tuple(
            dataclasses.replace(one, curve=one.curve - _mean(one.curve, share) if term.only_changes else one.curve)
            for one in formulas(low, width, scale * at, covariance, samples, term.symbol)
        ),
    )


def _mean(curve: np.ndarray, share: np.ndarray) -> float:
    """Of a curve over the range, over the samples' places in it."""
    return float(np.interp(share, np.linspace(0.0, 1.0, len(curve)), curve).mean())


def _covariance(
    search: Search, at: Sensitivity, values: np.ndarray, own: Sequence[str], names: Sequence[str]
) -> np.ndarray:
    """Of the coefficients `own`, (K, K), in shares of the largest, where all of `names` are free.

    A coefficient at a bound is as open as before the runs.
    """
    fitted = {name: float(values[search.problem.names.index(name)]) for name in names}
    known = uncertainty(at, names, fitted, search.bounds)
    determined, covariance = covariance_of(at, names, known)
    whole = search.config.term_prior_sigma**2 * np.eye(len(own))
    here = [(row, determined.index(name)) for row, name in enumerate(own) if name in determined]
    rows, columns = [row for row, _ in here], [column for _, column in here]
    whole[np.ix_(rows, rows)] = covariance[np.ix_(columns, columns)]
    return whole
