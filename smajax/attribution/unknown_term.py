"""Where something is missing that no effect of the library accounts for: an unknown term in each equation in turn.

Each term (`smajax.attribution.unknown.terms`) is a smooth function of one state. All are screened by the score test at the final
model of the search; the best of each equation are refitted together with the model's parameters and cross-validated as effects
are. The held-out runs can reject the best. What is learnt is a function: drawn over the states that the runs went through, and compared with
simple formulas.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.attribution.cross_validation import Fitted, Model, Search, Start, paired
from smajax.attribution.findings import UnknownTerm, UnknownTermBetter
from smajax.attribution.formulas import formulas
from smajax.attribution.score_test import Score, screen
from smajax.attribution.unknown.ranges import Sought, sought
from smajax.attribution.unknown.spline import COUNT, design
from smajax.attribution.unknown.terms import UNKNOWN, AbstractUnknown
from smajax.core.parameters import parameters
from smajax.core.progress import Stage
from smajax.core.whiteness import correlation_time, split_runs
from smajax.data.experiment.record import Prior
from smajax.fit.predicted import misfits
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity
from smajax.fit.uncertainty import covariance_of, uncertainty


@dataclass
class Terms(Search):
    """A search among unknown terms.

    One model carries them all, so that one compiled program serves the screening, every refit and every left-out run.
    """

    def restricted(self, effects: Sequence[str]) -> tuple[Problem, list[int]]:
        return self.problem, list(range(len(self.problem.names)))


def with_terms(setting: Search, final: Model) -> tuple[Terms, np.ndarray, Sought]:
    """(search among the terms that the runs can show, the final model's values in its order, what is sought)."""
    plain, index = setting.restricted(final.effects)
    system = plain.system_at(jnp.asarray(final.values[index]))
    found = sought(system, plain.batch)
    names = tuple(term.effect_name for term in found.terms)
    whole = dataclasses.replace(system, effects=(*system.effects, *found.terms))
    own = [name for name in parameters(whole) if name.split(".")[0] in names]
    known = {name: Prior(0.0, setting.config.term_prior_sigma, False) for name in own}
    problem = Problem.build(whole, plain.batch, plain.noise_sigma, plain.offset, priors=known)
    bounds = {**setting.bounds, **dict.fromkeys(own, (-1.0, 1.0))}
    unknowns = tuple(setting.free(final.effects))
    search = Terms(
        problem,
        unknowns,
        bounds,
        names,
        setting.cache,
        setting.progress,
        setting.noise_given,
        setting.held_out,
        config=setting.config,
    )
    return search, problem.start_values(), found


def screened(setting: Terms, values: np.ndarray) -> list[Score]:
    """Every term's score test at the final model, best first."""
    at = sensitivity(setting.problem, values, setting.every)
    return screen(at, setting.loose((), values), setting.candidates, setting.bounds)[0]


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
    """What was learnt of each term that came to the left-out runs, best first; the model with it if the first is named."""

    terms: tuple[UnknownTerm, ...] = ()
    model: Model | None = None


def unknown_terms(setting: Search, final: Model) -> Lacking:
    """An unknown term in each equation in turn, beside `final`.

    The first is `named` when it predicts left-out runs better than the final model does, by `Search.better` and
    `term_standard_errors`, and the held-out runs better at all. Terms that do better than none, too, and that it is not as far ahead of, stand in `indistinguishable`.
    """
    config = setting.config
    search, values, found = with_terms(setting, final)
    if not search.candidates:
        return Lacking()
    search.progress(Stage("looking for the equation that lacks something", 0.0))
    scores = screened(search, values)
    chosen = _best_of_each(scores, config.terms_refitted)
    search.progress(Stage("looking for the equation that lacks something", 1.0))
    if not chosen:
        return Lacking()
    base = Fitted((), search.known(dataclasses.replace(final, values=values)))
    fitted = refitted(search, chosen, values)[: config.terms_scored]
    present = search.cross_validated([base])[0]
    scored = sorted(search.cross_validated(fitted, present), key=lambda model: model.left_out_rmse)
    best = scored[0]
    enough, comparison = search.better(best, present, config.term_standard_errors)
    # One run fits too well to name anything: there is none to predict.
    enough = enough and len(present.left_out) > 1
    held_out = _on_held_out(search, present, best) if enough and search.held_out is not None else None
    enough = enough and (held_out is None or not held_out[1] >= held_out[0])
    others = [
        model
        for model in scored[1:]
        if model.left_out_rmse < present.left_out_rmse
        and not search.better(best, model, config.term_standard_errors)[0]
    ]
    terms = []
    gains = {score.effects: score.gain for score in scores}
    for model in scored:
        ahead = model is best and enough
        term = _learnt(search, found, model, present, gains[model.effects])
        if model is best:
            before, after = held_out if held_out is not None else (None, None)
            term = dataclasses.replace(
                term,
                named=ahead,
                indistinguishable=tuple(other.effects[0] for other in others) if ahead else (),
                comparison=comparison,
                held_out_before=before,
                held_out_after=after,
            )
        terms.append(term)
    return Lacking(tuple(terms), best if enough else None)


def _on_held_out(search: Terms, *models: Model) -> list[float]:
    """Rms error of each model on the held-out runs, SI."""
    problem, batch = search.problem, search.held_out
    assert batch is not None
    there = Problem.build(problem.system, batch, problem.noise_sigma, problem.offset)
    found = misfits(there, [model.values for model in models])
    return [float(np.sqrt((misfit**2).sum() / np.asarray(batch.mask).sum())) for misfit in found]


def in_place_of(setting: Search, first: Model, final: Model) -> Lacking | None:
    """One unknown term in the base model `first` that predicts left-out runs better than all the effects of `final`.

    By `term_standard_errors`, or at all where it has no more coefficients than they have. Then these are what the
    library has that comes near it, and none of them is missing: a round is noted in which they are removed.
    """
    found = unknown_terms(setting, first)
    if found.model is None or found.model.left_out_rmse >= final.left_out_rmse:
        return None
    ahead = paired(final.left_out, found.model.left_out, np.asarray(setting.problem.batch.mask))
    spent = sum(len(setting.coefficients(effect)) for effect in final.effects)
    if ahead <= setting.config.term_standard_errors and spent < COUNT:
        return None
    term = found.terms[0]
    setting.set_aside(final, UnknownTermBetter(term.title, final.left_out_rmse, term.left_out_after))
    return found


def refitted(search: Terms, chosen: Sequence[Score], values: np.ndarray) -> list[Fitted]:
    """Every chosen term fitted together with the model's parameters, best first.

    Each from zero, where it cannot end worse than the model without it, and from some way towards what the score test
    says, because a run whose transformation begins elsewhere lies in another local minimum.
    """
    config, starts = search.config, []
    for score in chosen:
        ahead = np.array(values)
        for name, size in score.coefficients.items():
            ahead[search.problem.names.index(name)] = np.clip(
                config.term_start_share * size, -config.term_start_limit, config.term_start_limit
            )
        starts += [Start(score.effects, values), Start(score.effects, ahead)]
    solutions, _ = search.fit(starts, "refitting unknown terms")
    every = sorted(zip(starts, solutions, strict=True), key=lambda pair: pair[1].cost)
    best: dict[tuple[str, ...], Fitted] = {}
    for start, solution in every:
        best.setdefault(start.effects, Fitted(start.effects, solution))
    return list(best.values())


def _term(found: Sought, model: Model) -> AbstractUnknown:
    return next(term for term in found.terms if term.effect_name == model.effects[0])


def _learnt(
    search: Terms,
    found: Sought,
    model: Model,
    present: Model,
    gain: float,
) -> UnknownTerm:
    """The function, its band, where the runs went, and formulas for it."""
    term = _term(found, model)
    own = search.coefficients(term.effect_name)
    others = search.free(())
    at = model.values[[search.problem.names.index(name) for name in own]]
    scale, low, width = float(term.scale), float(term.low), float(term.width)
    share = np.clip((found.states[term.effect_name] - low) / width, 0.0, 1.0)
    # About the mean over the samples, where a constant changes nothing.
    centre = design(share).mean(axis=0) if term.only_changes else np.zeros(len(own))
    grid = np.linspace(0.0, 1.0, search.config.term_points)
    basis = design(grid) - centre
    covariance, held_ones = (_covariance(search, model, own, names) * scale**2 for names in ((*others, *own), own))
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
        comparison=None,
        score_gain=gain,
        left_out_before=present.left_out_rmse,
        left_out_after=model.left_out_rmse,
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


def _covariance(search: Terms, model: Model, own: Sequence[str], names: Sequence[str]) -> np.ndarray:
    """Of the coefficients `own`, (K, K), in shares of the largest, where all of `names` are free.

    A coefficient at a bound is as open as before the runs.
    """
    at = sensitivity(search.problem, model.values, names)
    values = {name: float(model.values[search.problem.names.index(name)]) for name in names}
    known = uncertainty(at, names, values, search.bounds)
    determined, covariance = covariance_of(at, names, known)
    whole = search.config.term_prior_sigma**2 * np.eye(len(own))
    here = [(row, determined.index(name)) for row, name in enumerate(own) if name in determined]
    rows, columns = [row for row, _ in here], [column for _, column in here]
    whole[np.ix_(rows, rows)] = covariance[np.ix_(columns, columns)]
    return whole
