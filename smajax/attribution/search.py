"""Search for what the base model lacks: screen, refit the best single effects and pairs, cross-validate.

Round by round one effect (or a pair) is added. A candidate is scored by its error on each fit run in turn, fitted to
the others; the held-out runs are not looked at. The search stops when nothing stands out in the score test, or when
the best candidate does not predict left-out runs better beyond a penalty per coefficient and beyond chance.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.attribution.cross_validation import Evidence, Fitted, Model, Search, Start, base_value
from smajax.attribution.findings import (
    NoLongerNeeded,
    NothingSignificant,
    ResidualIsNoise,
    Round,
    RoundLimit,
    Scored,
    StepDependent,
)
from smajax.attribution.nuisance_grid import Scanned, scanned
from smajax.attribution.score_test import Score, screen, significant, switches
from smajax.attribution.step_size_check import gain_kept_at_half_step
from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.starts import logarithmic_points
from smajax.model.effects.library import LIBRARY


def start_values(
    model_values: np.ndarray, names: Sequence[str], score: Score, bounds: Mapping[str, tuple[float, float]]
) -> np.ndarray:
    """A fit, (P,), with an effect's coefficients moved off their base, to the side the score test points to.

    The effect's own side where the test is silent or points out of the bounds.
    """
    values = np.array(model_values)
    for effect in score.effects:
        for name, start in LIBRARY[effect].candidate.initial_guess.items():
            full = f"{effect}.{name}"
            size = score.place.get(full, start)
            asked = float(np.copysign(size, score.coefficients.get(full, 0.0) or size))
            low, high = bounds[full]
            if full in switches(effect):
                size = asked if low < asked < high else min(size, 0.5 * high)  # these runs may be of a small stroke
            values[names.index(full)] = size
    return values


def all_starts(
    model_values: np.ndarray,
    names: Sequence[str],
    score: Score,
    bounds: Mapping[str, tuple[float, float]],
    points: int = AttributionConfig().sobol_starts,
) -> list[np.ndarray]:
    """`start_values`, and the same with an effect at `points` Sobol points of the ranges from which a refit of it begins."""
    first = start_values(model_values, names, score, bounds)
    found = [first]
    for effect in score.effects:
        sizes = {name.removeprefix(f"{effect}."): one for name, one in score.coefficients.items()}
        ranges = LIBRARY[effect].candidate.start_ranges(sizes)
        if not ranges:
            continue
        for point in logarithmic_points(ranges, points):
            values = np.array(first)
            for name, one in point.items():
                values[names.index(f"{effect}.{name}")] = np.clip(one, *bounds[f"{effect}.{name}"])
            found.append(values)
    return found


def refit_starts(
    setting: Search, model: Model, score: Score, what: str, resident: Sequence[str]
) -> tuple[list[Start], float]:
    """Where a refit of a candidate begins, and the sum of squares that it has come to by then; infinite if not looked at.

    Of many places those from which a few steps come farthest, from where these end.
    """
    effects = (*model.effects, *score.effects)
    places = all_starts(
        setting.inside(model), setting.problem.names, score, setting.bounds, setting.config.sobol_starts
    )
    starts = [Start(effects, values) for values in places]
    if len(starts) <= setting.config.starts_continued:
        return starts, math.inf
    fits, _ = setting.fit(
        starts, what, most=setting.config.first_steps, resident=() if setting.compile_per_model else resident
    )
    best = sorted(fits, key=lambda one: one.cost)[: setting.config.starts_continued]
    return [Start(effects, one.values) for one in best], best[0].cost


def overlooked(setting: Search, model: Model, singles: Sequence[Score], what: str) -> list[Start]:
    """Starts of candidates with several local minima that the score test, which knows no jumps, leaves behind those that are refitted.

    Only where a few steps bring them farther than it promises the last of those.
    """
    found: list[Start] = []
    refitted = setting.config.singles_refitted
    for score in singles[refitted:]:
        starts, cost = refit_starts(setting, model, score, what, ())
        if 1.0 - cost / model.cost > singles[refitted - 1].gain:
            found += starts
    return found


def search(setting: Search, base: Fit) -> tuple[Model, Model]:
    """(base model, final model). Fills `setting.evidence` and `setting.rounds` on the way."""
    problem, config = setting.problem, setting.config
    first = setting.cross_validated([Fitted((), base)])[0]
    model = first
    for number in range(1, config.most_rounds + 1):
        left = [name for name in setting.candidates if name not in model.effects]
        singles, pairs = scores_at(setting, model, left)
        # The verdict will be that nothing more is missing: what could still be added would stand in for a run's chance.
        if setting.is_noise(model.values) and not hiding_in_noise(singles, config.gain_in_noise, config.significance):
            setting.note(Round(number, (), "", ResidualIsNoise()))
            break
        for score in singles:
            setting.evidence.setdefault(score.effects[0], Evidence(first_score=score))
        if not any(significant(scores, config.significance, config.penalty) for scores in (singles, pairs)):
            most = max((score.gain for score in singles), default=0.0)
            setting.note(Round(number, (), "", NothingSignificant(len(singles), most)))
            break
        chosen = [*singles[: config.singles_refitted], *pairs[: config.pairs_refitted]]
        what = f"round {number}: refitting candidates"
        resident = [*model.effects, *(effect for score in chosen for effect in score.effects)]
        starts = [start for score in chosen for start in refit_starts(setting, model, score, what, resident)[0]]
        solutions, _ = setting.fit(starts, what, hops=True)
        if not setting.is_noise(min(solutions, key=lambda one: one.cost).values):
            late = overlooked(setting, model, singles, what)
            starts += late
            solutions += setting.fit(late, what, hops=True)[0] if late else []
        found: dict[tuple[str, ...], Fit] = {}
        for start, solution in zip(starts, solutions, strict=True):
            if start.effects not in found or solution.cost < found[start.effects].cost:
                found[start.effects] = solution
        fitted = [Fitted(effects, solution) for effects, solution in found.items()]
        weighed = sorted(
            fitted, key=lambda entry: entry.solution.cost * (1.0 + config.penalty * len(setting.free(entry.effects)))
        )
        # It would have to predict left-out runs better than those that it was fitted to.
        most = config.cost_ratio * weighed[0].solution.cost if number > 1 else math.inf
        taken = [entry for entry in weighed if entry.solution.cost <= most]
        alone = next((entry for entry in weighed if len(entry.effects) == len(model.effects) + 1), taken[0])
        if alone not in taken:  # a pair is never added without its best single effect having had its chance
            taken = [*taken, alone]
        resident = [effect for start in starts for effect in start.effects]
        scored = setting.cross_validated(taken, model, resident)
        for entry in scored if number == 1 else ():
            if len(entry.effects) == 1:
                evidence = setting.evidence[entry.effects[0]]
                samples = float(np.asarray(problem.batch.mask).sum())
                evidence.alone_rmse = float(problem.noise_sigma * np.sqrt(entry.cost / samples))
                if problem.batch.runs > 1:
                    evidence.alone_left_out_rmse, evidence.base_left_out_rmse = entry.left_out_rmse, model.left_out_rmse
        best, alike, enough, reason = accepted_of(setting, scored, model)

        tried = tuple((added(entry, model), entry.left_out_rmse) for entry in scored)
        ties = tuple(added(entry, model) for entry in alike) if enough else ()
        setting.note(Round(number, tried, added(best, model) if enough else "", reason, ties))
        if not enough:
            break
        setting.path.append(model)
        model = best
    else:
        setting.note(Round(config.most_rounds + 1, (), "", RoundLimit(config.most_rounds)))
    return first, refined(setting, pruned(setting, model))


def hiding_in_noise(singles: Sequence[Score], share: float, significance: float) -> list[str]:
    """The single effects that would take more than that share of the residual's square, beyond chance."""
    level = significance / max(len(singles), 1)
    return [score.effects[0] for score in singles if score.p_value < level and score.gain > share]


def refined(setting: Search, model: Model) -> Model:
    """The final model taken to its optimum, from where it is and from a little off its bounds: error bars want that."""
    starts = [Start(model.effects, values) for values in (model.values, setting.inside(model))]
    fits, _ = setting.fit(starts, "polishing the final model", enough=setting.config.final_convergence, hops=True)
    best = min(fits, key=lambda one: one.cost)
    return dataclasses.replace(model, values=best.values, cost=best.cost) if best.cost < model.cost else model


def added(entry: Model, present: Model) -> str:
    """The effects that `entry` has beside those of `present`."""
    return " + ".join(name for name in entry.effects if name not in present.effects)


def accepted_of(setting: Search, scored: Sequence[Model], present: Model) -> tuple[Model, list[Model], bool, Scored]:
    """(the model to go on with, those as good, whether it is enough, why): `simplest`, less what depends on the step."""
    left = list(scored)
    step_dependent: tuple[StepDependent, ...] = ()
    while True:
        best, alike = simplest(setting, left, present)
        enough, comparison = setting.better(best, present)
        gain_kept = gain_kept_at_half_step(setting, best, present) if enough else 1.0
        if gain_kept >= setting.config.gain_kept_at_half_step:
            return best, alike, enough, Scored(comparison, step_dependent)
        step_dependent += (StepDependent(added(best, present), gain_kept),)
        left = [one for one in left if one is not best]
        if not left:
            return best, [], False, Scored(None, step_dependent)


def simplest(setting: Search, scored: Sequence[Model], present: Model) -> tuple[Model, list[Model]]:
    """Of the models that beat the present one, the best, or the smallest part of it that it does not beat.

    Beside it the others that are not distinguished from the best, but for those that only add to it. Among these a count of
    coefficients would prefer a small effect to a large one that is as likely. The best of all when none beats the
    present one: the caller then says by how much it falls short.
    """
    eligible = [m for m in scored if setting.better(m, present)[0]]
    best = min(eligible or scored, key=lambda m: m.left_out_rmse)
    alike = [m for m in eligible if m is best or not setting.better(best, m)[0]]
    parts = [m for m in alike if set(m.effects) <= set(best.effects)]
    chosen = min(parts or [best], key=lambda m: (len(setting.free(m.effects)), m.left_out_rmse))
    return chosen, [m for m in alike if not set(chosen.effects) <= set(m.effects)]


def scores_at(setting: Search, model: Model, left: Sequence[str]) -> tuple[list[Score], list[Score]]:
    """Score tests of the effects not yet in `model`, at its fit."""
    loose = setting.loose(model.effects, model.values)
    looked = scanned(setting, model.values, left, loose)
    singles, pairs = screen(looked.at, loose, left, setting.bounds)
    return [placed(score, looked) for score in singles], [placed(score, looked) for score in pairs]


def placed(score: Score, looked: Scanned) -> Score:
    """A score with the places at which it was taken; having looked at several of them counts against it."""
    place = {name: one for effect in score.effects for name, one in looked.place.get(effect, {}).items()}
    looks = math.prod(looked.looks.get(effect, 1) for effect in score.effects)
    return dataclasses.replace(score, place=place, p_value=min(1.0, score.p_value * looks))


def fewer(setting: Search, model: Model) -> Model:
    """`model` without the effect that came last: as the search had it, or fitted anew."""
    rest, names = model.effects[:-1], setting.problem.names
    for one in setting.path:
        if one.effects == rest:
            return one
    values = np.array(model.values)
    for name in setting.coefficients(model.effects[-1]):
        values[names.index(name)] = base_value(name)
    (fit,), _ = setting.fit([Start(rest, values)], "removing the last effect", hops=True)
    return setting.cross_validated([Fitted(rest, fit)])[0]


def pruned(setting: Search, model: Model) -> Model:
    """Take out again every effect that the others have made needless."""
    names = setting.problem.names
    while len(model.effects) > 1:
        starts = []
        for effect in model.effects:
            rest = tuple(name for name in model.effects if name != effect)
            values = np.array(model.values)
            for name in setting.coefficients(effect):
                values[names.index(name)] = base_value(name)
            starts.append(Start(rest, values))
        solutions, _ = setting.fit(starts, "removing effects", hops=True)
        whole = Fitted(model.effects, setting.known(model))
        kept, *scored = setting.cross_validated(
            [whole, *(Fitted(start.effects, solution) for start, solution in zip(starts, solutions, strict=True))]
        )
        # What only the run left out determines counts neither for nor against. It has been added beyond chance, alone
        # or with another: it goes when the left-out runs are predicted as well without it, its coefficients counted.
        counted = [setting.counted(whole, kept, entry) for entry in scored]
        for entry in scored:
            gone = next(name for name in model.effects if name not in entry.effects)
            setting.evidence[gone].without_left_out_rmse = entry.left_out_rmse
        against = {entry.effects: new for entry, new in zip(scored, counted, strict=True)}
        needless = [entry for entry in scored if not setting.better(against[entry.effects], entry, chance=0.0)[0]]
        if not needless:
            break
        best = min(needless, key=lambda m: m.left_out_rmse)
        gone = next(name for name in model.effects if name not in best.effects)
        reason = NoLongerNeeded(setting.better(against[best.effects], best)[1])
        tried = ((" + ".join(best.effects), best.left_out_rmse),)
        setting.note(Round(len(setting.rounds) + 1, tried, gone, reason, removed=True))
        model = best
    return model
