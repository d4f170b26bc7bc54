"""Search for what the base model lacks: screen, refit the best single effects and pairs, judge on runs left out.

Round by round one effect (or a pair) is added. A candidate is judged by its error on each fit run in turn, fitted to
the others; the held-out runs are not looked at. The search stops when nothing stands out in the score test, or when
the best candidate does not predict left-out runs better beyond a penalty per coefficient and beyond chance.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import qmc

from smajax.attribution.cross_validation import PENALTY, Evidence, Fitted, Model, Search, Start, base_value
from smajax.attribution.findings import Round
from smajax.attribution.nuisance_grid import Looked, looked_at
from smajax.attribution.score_test import Score, screen, significant, switches
from smajax.attribution.step_size_check import kept_at_half_the_step
from smajax.fit.levenberg_marquardt import Fit
from smajax.model.effects.library import LIBRARY

SIGNIFICANT = 1e-3  # of the score tests of one round, counted together
# What passes for noise is looked into all the same where one candidate alone would take more than this share of its square
# beyond chance: a slow trace as large as the noise may look like a slow noise, and a test of size and memory sees it late.
TOO_MUCH_FOR_NOISE = 0.2
SINGLES, PAIRS = 8, 2  # refitted in a round
BEHIND = 2.0  # times the best one's sum of squares: from the second round on a candidate farther behind is not judged
MOST_ROUNDS = 6
KEPT_AT_HALF_THE_STEP = 0.5  # share of its gain that an effect with which the load may jump has to keep
PLACES = 32  # of the ranges of an effect that has valleys; a power of two, for Sobol's points
FIRST, KEPT = 8, 4  # steps from each of them, before the worse ones are dropped, and that are carried to their end


def start_values(
    model_values: np.ndarray, names: Sequence[str], score: Score, bounds: Mapping[str, tuple[float, float]]
) -> np.ndarray:
    """A fit, (P,), with an effect's coefficients moved off their base, to the side the score test points to.

    The effect's own side where the test is silent or points out of the bounds.
    """
    values = np.array(model_values)
    for effect in score.effects:
        for name, start in LIBRARY[effect].starts.items():
            full = f"{effect}.{name}"
            size = score.place.get(full, start)
            asked = float(np.copysign(size, score.coefficients.get(full, 0.0) or size))
            low, high = bounds[full]
            if full in switches(effect):
                size = asked if low < asked < high else min(size, 0.5 * high)  # these runs may be of a small stroke
            values[names.index(full)] = size
    return values


def all_starts(
    model_values: np.ndarray, names: Sequence[str], score: Score, bounds: Mapping[str, tuple[float, float]]
) -> list[np.ndarray]:
    """`start_values`, and the same with an effect at Sobol's points of the ranges from which a refit of it begins."""
    first = start_values(model_values, names, score, bounds)
    found = [first]
    for effect in score.effects:
        told = {name.removeprefix(f"{effect}."): one for name, one in score.coefficients.items()}
        ranges = LIBRARY[effect].begins(told)
        if not ranges:
            continue
        low, high = np.log(np.asarray(list(ranges.values()))).T
        for share in qmc.Sobol(len(ranges), seed=0).random(PLACES):
            values = np.array(first)
            for name, one in zip(ranges, np.exp(low + share * (high - low)), strict=True):
                values[names.index(f"{effect}.{name}")] = np.clip(one, *bounds[f"{effect}.{name}"])
            found.append(values)
    return found


def begun(setting: Search, model: Model, score: Score, what: str, carried: Sequence[str]) -> tuple[list[Start], float]:
    """Where a refit of a candidate begins, and the sum of squares that it has come to by then; infinite if not looked at.

    Of many places those from which a few steps come farthest, from where these end.
    """
    effects = (*model.effects, *score.effects)
    places = all_starts(setting.inside(model), setting.problem.names, score, setting.bounds)
    starts = [Start(effects, values) for values in places]
    if len(starts) <= KEPT:
        return starts, math.inf
    fits, _ = setting.fit(starts, what, most=FIRST, carried=() if setting.apart else carried)
    best = sorted(fits, key=lambda one: one.cost)[:KEPT]
    return [Start(effects, one.values) for one in best], best[0].cost


def unforeseen(setting: Search, model: Model, singles: Sequence[Score], what: str) -> list[Start]:
    """Starts of candidates with valleys that the score test, which knows no jumps, leaves behind those that are refitted.

    Only where a few steps bring them farther than it promises the last of those.
    """
    found: list[Start] = []
    for score in singles[SINGLES:]:
        starts, cost = begun(setting, model, score, what, ())
        if 1.0 - cost / model.cost > singles[SINGLES - 1].gain:
            found += starts
    return found


def search(setting: Search, base: Fit) -> tuple[Model, Model]:
    """(base model, final model). Fills `setting.evidence` and `setting.rounds` on the way."""
    problem = setting.problem
    first = setting.judged([Fitted((), base)])[0]
    model = first
    for number in range(1, MOST_ROUNDS + 1):
        left = [name for name in setting.candidates if name not in model.effects]
        singles, pairs = scores_at(setting, model, left)
        # The verdict will be that nothing more is missing: what could still be added would stand in for a run's chance.
        if setting.is_noise(model.values) and not taking(singles, TOO_MUCH_FOR_NOISE):
            setting.note(Round(number, (), "", "what is left of the fit runs is measurement noise"))
            break
        for score in singles:
            setting.evidence.setdefault(score.effects[0], Evidence(first_score=score))
        if not any(significant(scores, SIGNIFICANT, PENALTY) for scores in (singles, pairs)):
            most = max((score.gain for score in singles), default=0.0)
            why = (
                f"no candidate stands out in the score test: none of {len(singles)} promises more than {most:.1%} of "
                "the mean square"
            )
            setting.note(Round(number, (), "", why))
            break
        chosen = [*singles[:SINGLES], *pairs[:PAIRS]]
        what = f"round {number}: refitting candidates"
        carried = [*model.effects, *(effect for score in chosen for effect in score.effects)]
        starts = [start for score in chosen for start in begun(setting, model, score, what, carried)[0]]
        solutions, _ = setting.fit(starts, what, hops=True)
        if not setting.is_noise(min(solutions, key=lambda one: one.cost).values):
            late = unforeseen(setting, model, singles, what)
            starts += late
            solutions += setting.fit(late, what, hops=True)[0] if late else []
        found: dict[tuple[str, ...], Fit] = {}
        for start, solution in zip(starts, solutions, strict=True):
            if start.effects not in found or solution.cost < found[start.effects].cost:
                found[start.effects] = solution
        fitted = [Fitted(effects, solution) for effects, solution in found.items()]
        weighed = sorted(
            fitted, key=lambda entry: entry.solution.cost * (1.0 + PENALTY * len(setting.free(entry.effects)))
        )
        # It would have to foretell left-out runs better than it follows those it was fitted to.
        most = BEHIND * weighed[0].solution.cost if number > 1 else math.inf
        taken = [entry for entry in weighed if entry.solution.cost <= most]
        alone = next((entry for entry in weighed if len(entry.effects) == len(model.effects) + 1), taken[0])
        if alone not in taken:  # a pair is never added without its best single effect having had its chance
            taken = [*taken, alone]
        carried = [effect for start in starts for effect in start.effects]
        judged = setting.judged(taken, model, carried)
        for entry in judged if number == 1 else ():
            if len(entry.effects) == 1:
                evidence = setting.evidence[entry.effects[0]]
                samples = float(np.asarray(problem.batch.mask).sum())
                evidence.alone_rmse = float(problem.noise_sigma * np.sqrt(entry.cost / samples))
                if problem.batch.runs > 1:
                    evidence.alone_left_out_rmse, evidence.base_left_out_rmse = entry.left_out_rmse, model.left_out_rmse
        best, alike, enough, why = taken_of(setting, judged, model)

        tried = tuple((added(entry, model), entry.left_out_rmse) for entry in judged)
        ties = tuple(added(entry, model) for entry in alike) if enough else ()
        setting.note(Round(number, tried, added(best, model) if enough else "", why, ties))
        if not enough:
            break
        setting.path.append(model)
        model = best
    else:
        why = f"the search ends after {MOST_ROUNDS} rounds, whatever more there may be"
        setting.note(Round(MOST_ROUNDS + 1, (), "", why))
    return first, refined(setting, pruned(setting, model))


def taking(singles: Sequence[Score], share: float) -> list[str]:
    """The single effects that would take more than that share of the residual's square, beyond chance."""
    level = SIGNIFICANT / max(len(singles), 1)
    return [score.effects[0] for score in singles if score.p_value < level and score.gain > share]


def refined(setting: Search, model: Model) -> Model:
    """The final model taken to its optimum, from where it is and from a little off its bounds: error bars want that."""
    starts = [Start(model.effects, values) for values in (model.values, setting.inside(model))]
    fits, _ = setting.fit(starts, "polishing the final model", enough=1e-8, hops=True)
    best = min(fits, key=lambda one: one.cost)
    return dataclasses.replace(model, values=best.values, cost=best.cost) if best.cost < model.cost else model


def added(entry: Model, present: Model) -> str:
    """The effects that `entry` has beside those of `present`."""
    return " + ".join(name for name in entry.effects if name not in present.effects)


def taken_of(setting: Search, judged: Sequence[Model], present: Model) -> tuple[Model, list[Model], bool, str]:
    """(the model to go on with, those as good, whether it is enough, why): `simplest`, less what hangs on the step."""
    left, hanging = list(judged), ""
    while True:
        best, alike = simplest(setting, left, present)
        enough, why = setting.better(best, present)
        kept = kept_at_half_the_step(setting, best, present) if enough else 1.0
        if kept >= KEPT_AT_HALF_THE_STEP:
            return best, alike, enough, hanging + why
        hanging += f"{added(best, present)} keeps {max(kept, 0.0):.0%} of its gain at half the step and is not taken; "
        left = [one for one in left if one is not best]
        if not left:
            return best, [], False, hanging.removesuffix("; ")


def simplest(setting: Search, judged: Sequence[Model], present: Model) -> tuple[Model, list[Model]]:
    """Of the models that beat the present one, the best, or the smallest part of it that it does not beat.

    Beside it the others that cannot be told from the best, but for those that only add to it. Among these a count of
    coefficients would prefer a small effect to a large one that is as likely. The best of all when none beats the
    present one: the caller then says by how much it falls short.
    """
    eligible = [m for m in judged if setting.better(m, present)[0]]
    best = min(eligible or judged, key=lambda m: m.left_out_rmse)
    alike = [m for m in eligible if m is best or not setting.better(best, m)[0]]
    parts = [m for m in alike if set(m.effects) <= set(best.effects)]
    chosen = min(parts or [best], key=lambda m: (len(setting.free(m.effects)), m.left_out_rmse))
    return chosen, [m for m in alike if not set(chosen.effects) <= set(m.effects)]


def scores_at(setting: Search, model: Model, left: Sequence[str]) -> tuple[list[Score], list[Score]]:
    """Score tests of the effects not yet in `model`, at its fit."""
    loose = setting.loose(model.effects, model.values)
    looked = looked_at(setting, model.values, left, loose)
    singles, pairs = screen(looked.at, loose, left, setting.bounds)
    return [placed(score, looked) for score in singles], [placed(score, looked) for score in pairs]


def placed(score: Score, looked: Looked) -> Score:
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
    (fit,), _ = setting.fit([Start(rest, values)], "taking the last effect out again", hops=True)
    return setting.judged([Fitted(rest, fit)])[0]


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
        solutions, _ = setting.fit(starts, "taking effects out again", hops=True)
        whole = Fitted(model.effects, setting.known(model))
        kept, *judged = setting.judged(
            [whole, *(Fitted(begun.effects, solution) for begun, solution in zip(starts, solutions, strict=True))]
        )
        # What only the run left out tells of it counts neither for nor against. It has been added beyond chance, alone
        # or with another: it goes when the left-out runs are predicted as well without it, its coefficients counted.
        credited = [setting.credited(whole, kept, entry) for entry in judged]
        for entry in judged:
            gone = next(name for name in model.effects if name not in entry.effects)
            setting.evidence[gone].without_left_out_rmse = entry.left_out_rmse
        against = {entry.effects: new for entry, new in zip(judged, credited, strict=True)}
        needless = [entry for entry in judged if not setting.better(against[entry.effects], entry, chance=0.0)[0]]
        if not needless:
            break
        best = min(needless, key=lambda m: m.left_out_rmse)
        gone = next(name for name in model.effects if name not in best.effects)
        why = f"taken out again: {setting.better(against[best.effects], best)[1]} with it is not enough"
        setting.note(
            Round(len(setting.rounds) + 1, ((" + ".join(best.effects), best.left_out_rmse),), f"without {gone}", why)
        )
        model = best
    return model
