"""Which effects the runs need: sets of effects by their evidence in the linear model, the best fitted, and so on from the likeliest.

Each round takes one Jacobian by the coefficients of all candidates at the likeliest fit so far, searches all sets of
effects in the linear model about it (`subset_evidence`), and fits the few best sets that have not been fitted, all
parameters together. A set counts by the evidence of its own fit (`laplace_evidence`), never by the linear model's. It
ends where no fitted set is likelier than the present one, and none is by more than `SETTLED_ODDS` in which one of its effects
is removed or replaced, or, while much is left, one of the likeliest others or several at once are added.

What the present model leaves is what an independent sample may be off by: at first the residual of the base model, so
only strong effects are added; the better the model, the finer the effects that it tells.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from smajax.attribution.detectable_effects import detectable
from smajax.attribution.exclusive_effects import in_another_way, of_groups, replaceable
from smajax.attribution.fitted_sets import JointRound, JointSearch
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.program_fits import BegunFit
from smajax.attribution.round_cache import Asked, key_of_round, loaded_round, save_round
from smajax.attribution.set_starts import as_fitted_before, at_usual_size, starts
from smajax.attribution.shape_starts import at_every_place
from smajax.attribution.side_by_side import LOOSELY, fit_continued, fit_side_by_side, grouped_sets
from smajax.attribution.subset_evidence import LinearModel, Subset, linear_model
from smajax.attribution.traces import Traces, Variant, begin_traces, traces_at
from smajax.fit.outputs_of_runs import made_ready
from smajax.fit.starts import nearest

BEGINS = "fitting what the search begins with"
USUAL_ROUNDS = "most searches end after 3 to 10"  # of the benchmark: 80 % of them, 6 in the median
LATE = "most searches have ended by now"  # said after `MANY_ROUNDS`
MANY_ROUNDS = 10
MOST_ROUNDS = 20  # the evidence rises in every one of them, so this only ends what should have ended
FITTED = 4  # sets a round
ALONE = 2  # and, beside the base model, of the effects of these sets the likeliest ones alone
REACH = 5.0  # nats below the best set in the linear model, within which a set is worth a fit
SETTLED = 0.05  # relative change of the error of a sample
CERTAIN = 100.0  # nats that the linear model loses without an effect, beyond which no refit makes up for it
UNEXPLAINED = 2.0  # noises that a sample may be off by, from which the likeliest others are fitted beside the effects
REPLACED = 2  # other effects that are tried in the place of each at the end
NEIGHBOURS = 12  # of these sets and those without an effect, the likeliest in the linear model
FAR_OFF = 0.1  # of the stroke: from here on every effect is fitted beside such a model
AT_ONCE = 2  # sets that add several effects, where no one more makes the model likelier, of the `REACHED` likeliest
REACHED = 12
LEAVES_IN_LINEAR = 4.0  # noises, up to which such a set may come down to noise when it is fitted
MANY = 3  # effects that leave much: from here on they stand in for something else, and one more changes little
SETTLED_ODDS = 1.0  # log odds: a model that is likelier by less is as likely, and the average has both


def search_jointly(search: JointSearch, starts: Mapping[tuple[str, ...], np.ndarray]) -> FittedModel:
    """The likeliest model, from fits of some sets of effects that end about `starts` (P,), the base model's, (), among them.

    Fills `search.fitted` and `search.rounds`.
    """
    for program, its_sets in grouped_sets(search, starts):
        for effects in its_sets:
            search.fitted[effects] = fitted_model(search.joint, effects, starts[effects], program)
    error = min(search.error(model) for model in search.fitted.values())
    # All to their end, however far behind: the base model is what every result is held against.
    begun = [BegunFit(effects, values, search.fitted[effects].width_factors) for effects, values in starts.items()]
    fit_side_by_side(search, begun, error, BEGINS, compared=False)
    present = search.best(error)
    error = search.error(present)
    checked: set[tuple[str, ...]] = set()  # models whose effects were removed and replaced one by one
    left: set[tuple[str, ...]] = set()  # models that were the likeliest before
    ended: list[FittedModel] = []  # models about which none is likelier
    widened: set[tuple[str, ...]] = set()  # models beside which several effects at once were tried
    shapes: set[tuple[str, ...]] = set()  # effects of groups of these, and of what was searched around in their place
    for number in range(MOST_ROUNDS):
        present = fit_continued(search, present, error, stage_of(search, number) if number else BEGINS)
        error = search.error(present)
        if search.needs_presets(present) or (len(present.effects) >= MANY and search.has_wrong_record(present)):
            break
        if present.effects in checked or any(len(effects) >= MANY for effects in left):
            # Not before a round has removed what a model of many effects has too much.
            other = search.in_place_of_many(present)
            if other is present:
                break
            if other is not None:
                ended, present, error = [*ended, present], noted(search, present, other), search.error(other)
        search.joint = dataclasses.replace(search.joint, width_factors=present.width_factors)
        last = present.effects in checked
        asked = asked_about(search, present, error, _neighbours if last else _promising)
        if asked.begun:
            fit_side_by_side(search, asked.begun, error, stage_of(search, number))
        best, before = search.best(error), present.log_evidence(error**2)
        gain = best.log_evidence(error**2) - before
        if best.effects in left - {present.effects} and gain < SETTLED_ODDS:
            # Of two that are as likely each is the likelier one seen from the other: what a sample may be off by differs.
            best = search.fitted[present.effects]
            gain = best.log_evidence(error**2) - before
        gains = tuple(
            (effects, search.fitted[effects].log_evidence(error**2) - before, search.fitted[effects].rms)
            for effects in dict.fromkeys(asked.sets)
            if effects in search.fitted  # a set whose fits have no number is none
        )
        done = JointRound(error, present.effects, gains, best.effects, gain)
        search.rounds.append(done)
        search.on_round(done)
        moved = best.effects != present.effects
        left |= {present.effects} if moved else set()
        present, now = best, search.error(best)
        alike = last and done.best_gain < SETTLED_ODDS and now > error / LOOSELY
        settled, error = abs(np.log(now / error)) < SETTLED, now
        if alike or (not moved and settled):
            explained = not present.effects and error < UNEXPLAINED * search.noise
            if explained or not search.thorough:
                break
            if not last:
                checked.add(present.effects)
                continue
            shapes.add(of_groups(present.effects))
            other = in_another_way(search.fitted.values(), present, shapes, error, SETTLED_ODDS)
            if other is not None:
                checked.add(other.effects)
            elif present.effects not in widened:
                widened.add(present.effects)
                # The traces are those of the model that the round began with.
                several = None if moved else _several_at_once(search, present, asked.traces, error, number)
                other = several or search.before_the_end(present)
                other = other and noted(search, present, other)
            if other is None:
                break
            ended, shapes = [*ended, present], shapes | {of_groups(other.effects)}
            present, error = other, search.error(other)
    present = max([*ended, present], key=lambda model: model.log_evidence(error**2))
    search.joint = dataclasses.replace(search.joint, width_factors=present.width_factors)
    search.winner = present.effects
    return present


def noted(search: JointSearch, present: FittedModel, other: FittedModel) -> FittedModel:
    """`other`, which is likelier than `present` at the error that it leaves itself, as what a round ended with."""
    error, gain = search.error(other), _gain(search, present, other)
    done = JointRound(error, present.effects, ((other.effects, gain, other.rms),), other.effects, gain)
    search.rounds.append(done)
    search.on_round(done)
    return other


def _gain(search: JointSearch, present: FittedModel, other: FittedModel) -> float:
    """Log evidence of `other` over that of `present`, at the error that `other` leaves itself."""
    variance = search.error(other) ** 2
    return other.log_evidence(variance) - present.log_evidence(variance)


def _effects(search: JointSearch, subset: Subset) -> tuple[str, ...]:
    return search.joint.ordered([variant.effect for variant in subset])


def _linear(search: JointSearch, present: FittedModel, error: float) -> tuple[LinearModel, Traces]:
    """The linear model at the present fit, searched from no effects and from the present ones."""
    traces = traces_at(search.joint, present, search.extent, search.detectable or None, None, search.traced)
    search.traced = traces.compiled
    if not search.detectable:
        found = detectable(search.joint, traces, search.noise)
        search.detectable = tuple(effect for effect in found if effect not in search.excluded)
    return _climbed(search, present, traces, error), traces


def _climbed(search: JointSearch, present: FittedModel, traces: Traces, error: float) -> LinearModel:
    """The linear model at `traces`, searched from no effects and from those of `present`; `error` of an independent sample, SI."""
    linear = linear_model(search.joint, traces, error**2, search.detectable)
    here: Subset = frozenset(Variant(effect, -1) for effect in present.effects)
    for start in {frozenset(), here}:
        linear.climb(start)
    return linear


def _promising(search: JointSearch, linear: LinearModel, present: FittedModel, error: float) -> list[Subset]:
    """The likeliest sets of the linear model that were not fitted at this error.

    About a base model that is off by many noises a linear model needs several effects for what one effect does when it is fitted.
    So there the likeliest effects of these sets are fitted alone as well.
    """
    ranked = linear.ranked()
    if not ranked:
        return []
    here = max(
        (linear.log_evidence(one) for one in ranked if _effects(search, one) == present.effects), default=-np.inf
    )
    least = max(here, linear.log_evidence(ranked[0])) - REACH
    sets: dict[tuple[str, ...], Subset] = {}
    for subset in ranked:
        effects = _effects(search, subset)
        if linear.log_evidence(subset) < least or len(sets) == FITTED:
            break
        if effects != present.effects and is_fresh(search, effects, error):
            sets.setdefault(effects, subset)
    if not present.effects:
        single = {frozenset({one}) for subset in sets.values() for one in subset}
        alone: dict[tuple[str, ...], Subset] = {}
        for subset in sorted(single, key=lambda one: -linear.log_evidence(one)):
            alone.setdefault(_effects(search, subset), subset)
        sets |= dict([(one, subset) for one, subset in alone.items() if is_fresh(search, one, error)][:ALONE])
    return list(sets.values())


def is_fresh(search: JointSearch, effects: tuple[str, ...], error: float) -> bool:
    """Whether a set was not yet fitted at about this error of a sample."""
    return abs(np.log(search.trials.get(effects, np.inf) / error)) > 2.0 * SETTLED


def _neighbours(search: JointSearch, linear: LinearModel, present: FittedModel, error: float) -> list[Subset]:
    """The present model without each of its effects, with the likeliest others in the place of each, and, while much is left beside few effects, with the likeliest beside them.

    A sample may then be off by so much that the linear model tells effects hardly apart, and one that is far from linear comes late in it.
    In the place of one of a group (`replaceable`) all others of it are tried: the farther they are from nothing the less a derivative there says of them.
    """
    here: Subset = frozenset(Variant(effect, -1) for effect in present.effects)
    others = [one for one in linear.places if one.effect not in present.effects]

    def likeliest(sets: Iterable[Subset]) -> list[Subset]:
        return _once(search, sorted(sets, key=lambda one: -linear.log_evidence(one)))

    def with_one(rest: Subset) -> list[Subset]:
        return likeliest(rest | {one} for one in others)

    near: list[Subset] = []
    for gone in here:
        near += [here - {gone}, *with_one(here - {gone})[:REPLACED]]
    near = likeliest(one for one in near if linear.log_evidence(one) > linear.log_evidence(here) - CERTAIN)
    alike = likeliest(here - {gone} | {one} for gone in here for one in others if replaceable(gone.effect, one.effect))
    near = _once(search, [*near[:NEIGHBOURS], *alike])
    near = [one for one in near if is_fresh(search, _effects(search, one), error)]
    if error < UNEXPLAINED * search.noise or len(present.effects) >= MANY:
        return near
    beside = [one for one in with_one(here) if np.isfinite(linear.log_evidence(one))]
    fresh = [one for one in beside if _effects(search, one) not in search.fitted]
    # A model that does not move as the runs do has derivatives that say nothing of what it lacks.
    return [*near, *fresh[: NEIGHBOURS if present.rms < FAR_OFF * search.extent.stroke else None]]


def _once(search: JointSearch, sets: Iterable[Subset]) -> list[Subset]:
    """The first one of each set of effects: of several places of an effect one is fitted."""
    first: dict[tuple[str, ...], Subset] = {}
    for one in sets:
        first.setdefault(_effects(search, one), one)
    return list(first.values())


def _several_at_once(
    search: JointSearch, present: FittedModel, traces_there: Callable[[], Traces], error: float, number: int
) -> FittedModel | None:
    """A model with several effects more that leaves little more than noise, where no one effect more makes `present`, of few effects, likelier.

    What a sample may be off by is large as long as something is missing. So of two effects that do little without each other neither is likelier than none, though
    with both next to nothing is left. The linear model is searched as if a sample were off by the geometric mean of that and the noise,
    and sets are fitted that leave little more than noise there; one counts where it is likelier at the error that it leaves itself. What
    it has too much goes in the rounds that follow.
    """
    if error < UNEXPLAINED * search.noise or len(present.effects) >= MANY:
        return None
    level = float(np.sqrt(error * search.noise))
    traces = traces_there()
    linear = _climbed(search, present, traces, level)
    sets = {
        effects: one
        for one in _once(search, linear.ranked())[:REACHED]
        if (effects := _effects(search, one)) not in search.fitted and linear.rms(one) < LEAVES_IN_LINEAR * search.noise
    }
    if not sets:
        return None
    begun = _begun(search, list(sets.values())[:AT_ONCE], linear, traces, level)
    fit_side_by_side(search, begun, level, stage_of(search, number))
    fitted = [search.fitted[effects] for effects in sets if effects in search.fitted]
    better = [one for one in fitted if one.rms < UNEXPLAINED * search.noise and search.error(one) < error]
    best = max(better, key=lambda one: _gain(search, present, one), default=None)
    return best if best is not None and _gain(search, present, best) > SETTLED_ODDS else None


def asked_about(
    search: JointSearch,
    present: FittedModel,
    error: float,
    chosen: Callable[[JointSearch, LinearModel, FittedModel, float], list[Subset]],
    *settings: object,
) -> Asked:
    """What a round fits beside `present`: the sets that are `chosen` in the linear model there, and where their fits begin.

    `settings`: what `chosen` depends on beside its arguments. Cached: tracing the programs of the linear model takes most of the time
    in which a search that resumes comes to where it was.
    """
    cache, joint, candidates, before = search.settings.cache, search.joint, search.detectable or None, search.traced
    key = key_of_round(search, present, error, chosen.__name__, *settings)
    known = loaded_round(cache, key, lambda: traces_at(joint, present, search.extent, candidates, None, before))
    if known is not None:
        search.detectable, search.programs, search.traced = known.detectable, known.programs, known.traced
        return known
    linear, traces = _linear(search, present, error)
    search.begin_ahead(present)
    sets = chosen(search, linear, present, error)
    effects = tuple(_effects(search, one) for one in sets)
    if sets and not present.effects:
        # What is likeliest beside the base model is most often what the next round begins with.
        begin_traces(joint, effects[0], search.detectable, search.traced)
    begun = _begun(search, sets, linear, traces, error)
    asked = Asked(effects, tuple(begun), search.detectable, search.programs, search.traced, lambda: traces)
    save_round(cache, key, asked)
    return asked


def stage_of(search: JointSearch, number: int) -> str:
    """What is said of the fits of a round of a search, its first one 0."""
    now = search.rounds_before + number + 1
    return f"round {now} ({USUAL_ROUNDS if now <= MANY_ROUNDS else LATE}): fitting the likeliest sets of effects"


def _begun(
    search: JointSearch, sets: Sequence[Subset], linear: LinearModel, traces: Traces, error: float
) -> list[BegunFit]:
    """Fits of the sets, from the present values and from where the linear model points to."""
    if not sets:
        return []
    joint = dataclasses.replace(search.joint, width_factors={**search.joint.width_factors, **linear.width_factors})
    begun: list[BegunFit] = []
    # About the base model the places of a shape are in the linear model, and their fits would be those of every search.
    far_off = traces.present and search.error_of(traces.present) > UNEXPLAINED * search.noise
    groups = grouped_sets(search, [_effects(search, subset) for subset in sets])
    restricted = [joint.restricted(program) for program, _ in groups]
    made_ready([problem for problem, _ in restricted])
    for (_, its_sets), (problem, index) in zip(groups, restricted, strict=True):
        here = [subset for subset in sets if _effects(search, subset) in its_sets]
        points = [starts(joint, subset, linear, traces) for subset in here]
        for subset, start in zip(here, nearest(problem.with_noise(error), points, index), strict=True):
            effects = _effects(search, subset)
            begun.append(BegunFit(effects, start, linear.width_factors))
            if set(effects) - set(traces.present):
                # And, where an effect is new, from its usual size: near zero the misfit may have a minimum of its own.
                usual = at_usual_size(joint, subset, traces, start)
                begun += [BegunFit(effects, one, linear.width_factors) for one in usual]
                before = as_fitted_before(joint, subset, traces, start, search.fitted.values(), error)
                places = at_every_place(joint, subset, traces, start) if far_off else ()
                begun += [BegunFit(effects, one, linear.width_factors) for one in (*before, *places)]
    return begun
