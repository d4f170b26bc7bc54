"""Where something is missing that no effect of the library accounts for: an unknown term in each equation in turn.

Each term (`smajax.attribution.unknown.terms`) is a smooth function of one state. All are screened by the score test at the final
model of the search; the best of each equation are refitted together with the model's parameters and judged as effects
are, on runs left out. The held-out runs can refuse the best. What is learnt is a function: drawn over the states that the runs went through, and compared with
simple formulas.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from smajax.attribution.cross_validation import Fitted, Model, Search, Start, paired
from smajax.attribution.findings import UnknownTerm
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

REFITTED = 6  # terms
JUDGED = 6  # of them, taken to the left-out runs
# Standard errors by which a term must do better than none, and than another that does better than none, to be named: of
# a dozen that were tried the best is one standard error ahead by luck alone.
APART = 2.0
TOWARDS, INSIDE = 0.5, 0.8  # of the score test's estimate, and at most this share of the largest: where a refit begins
WEAK = 1.0  # sigma of the prior of every coefficient about zero, in shares of the largest: a fit is then well posed
GRID = 61  # points at which a function is drawn
CELLS = 20  # of its range, in which samples are counted


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
    known = {name: Prior(0.0, WEAK, False) for name in own}
    problem = Problem.build(whole, plain.batch, plain.noise_sigma, plain.offset, priors=known)
    bounds = {**setting.bounds, **dict.fromkeys(own, (-1.0, 1.0))}
    unknowns = tuple(setting.free(final.effects))
    search = Terms(
        problem,
        unknowns,
        bounds,
        names,
        setting.cache,
        setting.shown,
        setting.progress,
        setting.noise_given,
        setting.held_out,
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
        firsts.setdefault(UNKNOWN[score.effects[0]].equation, score)
    leading = list(firsts.values())
    rest = [score for score in scores if score not in leading]
    return [score for score in [*leading, *rest][:count] if score.gain > 0.0]


@dataclass(frozen=True)
class Lacking:
    """What was learnt of each term that came to the runs left out, best first; the model with it if the first is named."""

    terms: tuple[UnknownTerm, ...] = ()
    model: Model | None = None


def unknown_terms(setting: Search, final: Model) -> Lacking:
    """An unknown term in each equation in turn, beside `final`.

    The first is `named` when it foretells left-out runs better than the final model does, by `Search.better` and `APART`
    standard errors, and the held-out runs better at all. Terms that do better than none, too, and that it is not as far ahead of, stand in `alike`.
    """
    search, values, found = with_terms(setting, final)
    if not search.candidates:
        return Lacking()
    search.progress(Stage("looking for the equation that lacks something", 0.0))
    scores = screened(search, values)
    chosen = _best_of_each(scores, REFITTED)
    search.progress(Stage("looking for the equation that lacks something", 1.0))
    if not chosen:
        return Lacking()
    base = Fitted((), search.known(dataclasses.replace(final, values=values)))
    fitted = refitted(search, chosen, values)[:JUDGED]
    present = search.judged([base])[0]
    judged = sorted(search.judged(fitted, present), key=lambda model: model.left_out_rmse)
    best = judged[0]
    enough, why = search.better(best, present, APART)
    # One run fits too well to name anything: there is none to foretell.
    enough = enough and len(present.left_out) > 1
    borne_out = _on_held_out(search, present, best) if enough and search.held_out is not None else None
    if borne_out is not None and borne_out[1] >= borne_out[0]:
        enough, why = (
            False,
            f"{why}; but on the held-out runs {search.shown(borne_out[0])} -> {search.shown(borne_out[1])}",
        )
    rivals = [
        model
        for model in judged[1:]
        if model.left_out_rmse < present.left_out_rmse and not search.better(best, model, APART)[0]
    ]
    told = []
    gains = {score.effects: score.gain for score in scores}
    for model in judged:
        ahead = model is best and enough
        alike = tuple(rival.effects[0] for rival in rivals) if ahead else ()
        said = why if model is best else ""
        learnt = _learnt(search, found, model, present, gains[model.effects], ahead, alike, said)
        if model is best and borne_out is not None:
            learnt = dataclasses.replace(learnt, held_out_before=borne_out[0], held_out_after=borne_out[1])
        told.append(learnt)
    return Lacking(tuple(told), best if enough else None)


def _on_held_out(search: Terms, *models: Model) -> list[float]:
    """Rms error of each model on the held-out runs, SI."""
    problem, batch = search.problem, search.held_out
    assert batch is not None
    there = Problem.build(problem.system, batch, problem.noise_sigma, problem.offset)
    found = misfits(there, [model.values for model in models])
    return [float(np.sqrt((misfit**2).sum() / np.asarray(batch.mask).sum())) for misfit in found]


def in_place_of(setting: Search, first: Model, final: Model) -> Lacking | None:
    """One unknown term in the base model `first` that foretells left-out runs better than all the effects of `final`.

    By `APART` standard errors, or at all where it has no more coefficients than they have. Then these are what the
    library has that comes near it, and none of them is missing: a round is noted in which they are set aside.
    """
    found = unknown_terms(setting, first)
    if found.model is None or found.model.left_out_rmse >= final.left_out_rmse:
        return None
    ahead = paired(final.left_out, found.model.left_out, np.asarray(setting.problem.batch.mask))
    spent = sum(len(setting.coefficients(effect)) for effect in final.effects)
    if ahead <= APART and spent < COUNT:
        return None
    term = found.terms[0]
    setting.set_aside(
        final,
        f"{term.title} alone foretells left-out runs better than all of them, "
        f"{setting.shown(final.left_out_rmse)} -> {setting.shown(term.left_out_after)}",
    )
    return found


def refitted(search: Terms, chosen: Sequence[Score], values: np.ndarray) -> list[Fitted]:
    """Every chosen term fitted together with the model's parameters, best first.

    Each from zero, where it cannot end worse than the model without it, and from some way towards what the score test
    says, because a run whose transformation begins elsewhere lies in another valley.
    """
    starts = []
    for score in chosen:
        ahead = np.array(values)
        for name, size in score.coefficients.items():
            ahead[search.problem.names.index(name)] = np.clip(TOWARDS * size, -INSIDE, INSIDE)
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
    named: bool,
    alike: tuple[str, ...],
    why: str,
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
    grid = np.linspace(0.0, 1.0, GRID)
    basis = design(grid) - centre
    covariance, held_ones = (_covariance(search, model, own, names) * scale**2 for names in ((*others, *own), own))
    error, error_held = (
        np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, one, basis), 0.0)) for one in (covariance, held_ones)
    )
    counts = np.histogram(share, CELLS, (0.0, 1.0))[0]
    mask = np.asarray(search.problem.batch.mask)
    misfit = misfits(search.problem, [model.values])[0]
    samples = float(mask.sum()) / correlation_time(split_runs(misfit, mask))
    reading = search.problem.system.load.reading[1]
    state_unit, unit = (reading if one == "reading" else one for one in (term.state_unit, term.unit))
    return UnknownTerm(
        name=term.effect_name,
        title=term.title,
        equation=term.equation,
        symbol=term.symbol,
        state=term.state,
        state_unit=state_unit,
        unit=unit,
        named=named,
        alike=alike,
        why=why,
        score_gain=gain,
        left_out_before=present.left_out_rmse,
        left_out_after=model.left_out_rmse,
        held_out_before=None,
        held_out_after=None,
        at=low + width * grid,
        values=scale * basis @ at,
        error=error,
        error_held=error_held,
        cells=low + width * np.linspace(0.0, 1.0, CELLS + 1),
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
    told, covariance = covariance_of(at, names, known)
    whole = WEAK**2 * np.eye(len(own))
    here = [(row, told.index(name)) for row, name in enumerate(own) if name in told]
    rows, columns = [row for row, _ in here], [column for _, column in here]
    whole[np.ix_(rows, rows)] = covariance[np.ix_(columns, columns)]
    return whole
