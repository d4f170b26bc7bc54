"""Where something is missing that no effect of the library accounts for: an unknown term in each equation in turn.

Each term (`smajax.attribution.unknown.terms`) is a smooth function of one state. All are screened by the score test at the final
model of the search; the best of each equation are fitted together with the model's parameters and compared by their evidence, as
sets of effects are. The held-out runs can reject the likeliest. What is learnt is a function: drawn over the states that the runs
went through, and compared with simple formulas.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from smajax.attribution.asked_ahead import AskedAhead, ask_ahead
from smajax.attribution.explained_share import EXPLAINED, explained_share
from smajax.attribution.findings import UnknownTerm
from smajax.attribution.formulas import formulas
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.leave_one_run_out import predicting
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.paired_errors import compared, pooled_rms
from smajax.attribution.reasons import UnknownTermLikelier
from smajax.attribution.unknown.ranges import Sought
from smajax.attribution.unknown.spline import design
from smajax.attribution.unknown.term_fits import (
    APPROXIMATE,
    FITTING_TERMS,
    INDISTINGUISHABLE,
    TermFits,
    fits_with_terms,
    least_error,
)
from smajax.attribution.values_per_run import held_out_owners, held_out_residuals
from smajax.core.whiteness import correlation_time, split_runs
from smajax.fit.integration import unlimited, with_integration
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.uncertainty import covariance_of, uncertainty
from smajax.model.channels import INPUT_UNITS

SAME = 1e-3  # of a root mean square: a fit that a hundredth in log evidence may still lower


@dataclass(frozen=True)
class Lacking:
    """What was learnt of each term that was fitted, likeliest first; the first as it was fitted if it is named."""

    terms: tuple[UnknownTerm, ...] = ()
    likeliest: FittedModel | None = None


@dataclass(frozen=True)
class AskedFor:
    """Unknown terms that were asked for beside one model; `fits`: None where none promises anything."""

    fits: TermFits | None
    learn: Callable[[], Lacking]

    @cached_property
    def found(self) -> Lacking:
        """What the fits say, when it is first asked for: runs are left out for it, which takes as long as the fits."""
        return self.learn()


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
    log_odds = [fits.log_odds(one, error) for one in fitted]
    likeliest = fitted[0]
    # One run fits too well to name anything: there is none to predict.
    asked = log_odds[0] > 0.0 and search.problem.batch.runs > 1
    least = max(0.0, log_odds[0] - max(INDISTINGUISHABLE, APPROXIMATE * log_odds[0]))
    alike = [model.effects[-1] for model, odds in zip(fitted[1:], log_odds[1:], strict=True) if odds > least]
    predict: dict[str, float] = {}
    without, enough = math.nan, False
    if asked:
        # The runs are left out of what is named, or may be in its place: refits take as long as the fits.
        program_of = fits.programs
        noise = float(search.problem.noise_sigma)
        without = predicting(fits.joint, fits.none, error, noise, program_of[likeliest.effects[-1]]).left_out_rmse
        predict = {
            name: predicting(fits.joint, model, error, noise, program_of[name]).left_out_rmse
            for model in fitted
            if (name := model.effects[-1]) in (likeliest.effects[-1], *alike)
        }
        enough = _explains(predict[likeliest.effects[-1]], without, noise)
    held_out = None
    if enough and search.held_out is not None:
        both = [fits.none.values, likeliest.values]
        plain, with_it = held_out_residuals(search, search.candidates, both)
        held_out = pooled_rms(plain), pooled_rms(with_it)
        enough = compared(with_it, plain, setting.config, held_out_owners(search)) != "worse"
    terms: list[UnknownTerm] = []
    for model, odds in zip(fitted, log_odds, strict=True):
        left_out = without, predict.get(model.effects[-1])
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
    """Whether a function takes away `EXPLAINED` of the squares that the error on runs left out has beyond the noise; root mean squares, SI."""
    return explained_share(with_it, without, noise) >= EXPLAINED


class Asking(NamedTuple):
    """Fits of unknown terms beside a model that a second process may be making."""

    model: Model | FittedModel
    likely: tuple[str, ...]
    fits: AskedAhead[TermFits | None]


def begin_asking(setting: Search, model: Model | FittedModel, likely: Sequence[str]) -> Asking:
    """What `asked_for` with the same arguments needs, by a second process where there is one."""
    of_model = model, tuple(likely)
    return Asking(*of_model, ask_ahead(FITTING_TERMS, setting, fits_with_terms, *of_model))


def asked_for(
    setting: Search, model: Model | FittedModel, likely: Sequence[str] = (), asking: Asking | None = None
) -> AskedFor:
    """Unknown terms beside `model`. `likely`: as of `fits_with_terms`. `asking`: what was begun, which counts if it is of the same model; its `likely` do anyhow, so that with or without a second process the programs are the same."""
    if asking is not None and np.array_equal(asking.model.values, model.values):
        fits = asking.fits.result()
    else:
        fits = fits_with_terms(setting, model, likely if asking is None else asking.likely)
    if fits is None:
        return AskedFor(None, Lacking)
    search = dataclasses.replace(fits.search, progress=setting.progress, cache=setting.cache)
    fits = dataclasses.replace(fits, search=search)
    return AskedFor(fits, partial(learnt, setting, fits))


def in_place_of(setting: Search, first: Model, final: Model, asked: AskedFor | None = None) -> Lacking | None:
    """One unknown term in the base model `first` that is likelier than the base model with all the effects of `final`.

    Then these are what the library has that comes near it, and none of them is missing: a round is noted in which they are
    removed. So too where the term explains too little to be named, and they explain less and are far behind. `asked`: terms that were asked for beside the base model before.
    """
    if asked is None or not _same_base(setting, first, asked):
        asked = asked_for(setting, first)
    fits = asked.fits
    if fits is None:
        return None
    joint = setting.joint(setting.candidates)
    effects = fitted_model(joint, final.effects, final.values, final.effects)
    error = least_error(setting, [effects, *fits.fitted])
    ahead = max(one.log_evidence(error**2) for one in fits.fitted) - effects.log_evidence(error**2)
    if ahead <= 0.0:
        return None
    found = asked.found
    best = found.terms[0]
    little = ahead > INDISTINGUISHABLE and best.log_odds > 0.0 and best.held_out_before is None
    little = little and _less(best.left_out_after, min(best.left_out_before, final.left_out_rmse))
    if found.likeliest is None and not little:
        return None
    setting.set_aside(final, UnknownTermLikelier(found.terms[0].title, ahead))
    return found


def _same_base(setting: Search, first: Model, asked: AskedFor) -> bool:
    """Whether terms were asked for beside the base model where it is now: it may have been on its way to its optimum."""
    if asked.fits is None:
        return True
    problem, index = setting.restricted(first.effects)
    rms = setting.rmse(misfits(problem, [first.values[index]])[0])
    return abs(asked.fits.none.rms / rms - 1.0) < SAME


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
    # The fit came to where its runs take just the tries that they may: by another program's rounding one more.
    problem = with_integration(search.problem, unlimited(search.problem.batch.integration))
    sensitive = sensitivity(problem, model.values, [*others, *own])
    covariance, held_ones = (
        _covariance(search, sensitive, model.values, own, names) * scale**2 for names in ((*others, *own), own)
    )
    error, error_held = (
        np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, one, basis), 0.0)) for one in (covariance, held_ones)
    )
    counts = np.histogram(share, search.config.term_bins, (0.0, 1.0))[0]
    mask = np.asarray(search.problem.batch.mask)
    misfit = misfits(problem, [model.values])[0]
    samples = float(mask.sum()) / correlation_time(split_runs(misfit, mask))
    system = search.problem.system
    command = next((INPUT_UNITS[one] for one in system.drive.inputs_required), "-")
    units = {"reading": system.load.reading[1], "command": command}
    state_unit, unit = (units.get(one, one) for one in (term.state_unit, term.unit))
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
