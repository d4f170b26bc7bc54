"""The joint search as a stage of `close-loop`: it takes the base fit, and gives the models that the later stages take.

Effects whose gain is gone at half the step of the integration are excluded and the search is made again without them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from smajax.attribution.doubtful_runs import Left, left_without
from smajax.attribution.exclusive_effects import replaceable
from smajax.attribution.findings import Round
from smajax.attribution.fits_alone import described_alone, fitted_alone, likeliest_alone
from smajax.attribution.fitted_sets import JointRound, JointSearch
from smajax.attribution.freed_presets import freed_at_the_base, freed_by_a_step, nearer_base, needs_presets
from smajax.attribution.input_of_run import FAR_LESS
from smajax.attribution.joint_search import MANY, search_jointly
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.model_fits import Evidence, Model, Search
from smajax.attribution.nearest_alone import nearest_alone
from smajax.attribution.optimum import (
    as_model,
    final_model,
    leaves_noise,
    refined,
    with_no_effect_hardly_needed,
    with_no_effect_too_many,
)
from smajax.attribution.reasons import LikelierModel, NoLikelierModel, Reason, StepDependent
from smajax.attribution.same_as_parameters import said_by_parameters
from smajax.attribution.side_by_side import fitted_from, program_compiled
from smajax.attribution.step_size_check import begin_finer_integration, gain_kept_at_half_step
from smajax.attribution.unknown.search import AskedFor, Asking, asked_for, begin_asking
from smajax.attribution.unknown.terms import UNKNOWN
from smajax.core.worker_process import is_idle
from smajax.fit.levenberg_marquardt import Fit, FitSettings
from smajax.fit.outputs_of_runs import begin_derivatives
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior

SOON = 3  # rounds, after which a search may end soon
LIKELIEST = 4  # sets of effects from which the search goes on with the values of presets free


@dataclass
class _Stage:
    setting: Search
    settings: FitSettings
    excluded: set[str] = field(default_factory=set)
    asked: list[AskedFor] = field(default_factory=list)  # unknown terms beside the base model, once they were asked for
    asking: Asking | None = None  # what a second process may be fitting for that
    asked_for_records: set[bool] = field(default_factory=set)  # searches (`thorough`) that ask for no wrong record

    def joint_search(self, presets: Mapping[str, CoefficientPrior]) -> JointSearch:
        """Among the candidates that were not excluded."""
        setting = self.setting
        joint = setting.joint(setting.candidates, presets)
        noise = float(setting.problem.noise_sigma)
        before = len(setting.rounds)
        search = JointSearch(
            joint,
            setting.extent,
            self.settings,
            noise,
            setting.noise_given,
            excluded=frozenset(self.excluded) | said_by_parameters(joint),
            rounds_before=before,
            thorough=bool(presets) or not setting.presets,  # the last search
        )
        search.on_round = partial(self.note, search)
        search.begin_ahead = partial(self.begin_ahead, search)
        if search.thorough:  # else values of presets are held, which no function is beside
            search.in_place_of_many = partial(self.in_place_of_many, search)
            search.before_the_end = partial(self.before_the_end, search)
        search.has_wrong_record = partial(self.has_wrong_record, search)
        return search

    def searched(self, base: np.ndarray) -> tuple[JointSearch, FittedModel]:
        """(the search, likeliest model), from the base model fitted at `base` (P,).

        Where more than noise is left, the search is made again from the base model without the effects of bench and events that were found. One of
        these may have come first because it does a part of what several effects of the wire do together, and no step of the search,
        which changes one effect at a time, takes it out again. If what is found then is likelier, the search goes on from there with
        all effects. On the measured bias-spring bench a limit of the sensor stood for three others. Many effects that leave much all the same stand
        for something else anyhow.
        """
        search, found = self._from_base(base, ())
        doubted = [effect for effect in found.effects if LIBRARY[effect].candidate.prior_class != "material"]
        if not doubted or search.wrong_record or len(found.effects) >= MANY or leaves_noise(self.setting, found):
            return search, found
        # And without what looks much the same, which has been tried in their place.
        alike = {name for name in search.joint.coefficients for one in doubted if replaceable(name, one)}
        # No record is asked for without them: it would be held against less likely models than were found.
        given = self.excluded | alike | set(doubted), self.asked, self.asking
        rest = _Stage(self.setting, self.settings, *given, {True, False})
        other, instead = rest._from_base(base, search.programs)
        search.fitted = {**other.fitted, **search.fitted}
        error = search.error(search.best(search.error(found)))
        if instead.log_evidence(error**2) <= found.log_evidence(error**2):
            return search, found
        return self.resumed(search, instead)

    def _from_base(self, base: np.ndarray, programs: tuple[tuple[str, ...], ...]) -> tuple[JointSearch, FittedModel]:
        """(the search, likeliest model), from the base model. `programs`: those that are compiled already.

        The values of presets are free from the beginning where they alone lower the base model's error much: with wrong values held, effects that
        are not there are named in their place. Elsewhere they are held at first, and free from the effects on beside which they take most of what is left, or
        else from the likeliest sets of effects on: from the base model alone fits that free them too may end in local minima.
        """
        held = self.joint_search({})
        held.programs = programs
        if not self.setting.presets:
            return held, search_jointly(held, {(): base})
        free = self.joint_search(self.setting.presets)
        free.programs = programs
        before = fitted_model(held.joint, (), base, ())
        after = fitted_from(free, before)
        if freed_at_the_base(after, before):
            return free, search_jointly(free, {(): after.values})
        held.programs = free.programs
        held.needs_presets = partial(needs_presets, held, free)
        found = search_jointly(held, {(): base})
        if held.free_beside is not None:
            kept_by_a_fit = found.effects == held.free_beside  # and not promised by a step
            if kept_by_a_fit:  # where the next search begins
                held.fitted[found.effects] = free.fitted.get(found.effects, found)
            freed, instead = self.resumed(held, held.fitted[held.free_beside], most=1)
            if kept_by_a_fit or instead.rms < found.rms or freed.wrong_record:
                return freed, instead
            held.programs = freed.programs  # one step had promised more than a fit came to
        return (held, found) if held.wrong_record else self.resumed(held, found)

    def in_place_of_many(self, search: JointSearch, found: FittedModel) -> FittedModel | None:
        """`found` itself where it has many effects that leave more than noise, and an unknown function in the base model that is named leaves only noise and is likelier.

        The effects then stand in for it, and every one that is added has less to go by. One effect that is likelier than they are comes first.
        """
        if len(found.effects) < MANY or leaves_noise(self.setting, found):
            return None
        if not search.asked_for_one:
            search.asked_for_one = True
            if (one := self._one_of_all(search, found)) is not None:
                return one
        asked = self._asked(search, found)
        if asked.fits is None or not self._likelier(search, found, asked.fits.fitted[:1]):
            return None
        named = asked.found.likeliest
        if named is None or not leaves_noise(self.setting, named):
            return None
        return self._one_effect(search, found, [named]) or found

    def has_wrong_record(self, search: JointSearch, found: FittedModel) -> bool:
        """Whether the search ends because inputs of runs were recorded wrongly, or values of presets are what was missing; where `found` has many effects and leaves many noises.

        They may stand in for it, and each round about them costs more than to ask. A wrong record is sought beside those of the base model and `found` that leave much less of the other runs when one or two runs are left out, and the likeliest model
        of few effects; once a search, and as long as none does, it is not asked.
        """
        ask = self.setting.wrong_record
        if ask is None or search.thorough in self.asked_for_records or found.rms < FAR_LESS * search.noise:
            return False
        few = [one for one in search.fitted.values() if 0 < len(one.effects) < MANY]
        variance = min(map(search.error, few), default=1.0) ** 2
        likeliest = sorted(few, key=lambda one: -one.log_evidence(variance))[:1]
        models = [search.fitted[()], *likeliest, found]
        left = [self._without_runs(search, one) for one in models]
        better = [any(one.stands_out for one in its_left) for its_left in left]
        # That of the base model with values of presets free was fitted before.
        by_a_step = None if search.thorough else freed_by_a_step(models[1:], left[1:], found)
        if not any(better):
            search.free_beside = by_a_step
            return search.free_beside is not None
        # What many effects stand in for may be one of the few beside the record.
        hosts = [one for one, much in zip(models, better, strict=True) if much or one in likeliest]
        self.asked_for_records.add(search.thorough)
        wrong = ask(hosts, found)
        if wrong is not None and not wrong.errors:
            search.free_beside = None if search.thorough else search.joint.ordered(wrong.beside)
            return search.free_beside is not None
        if wrong is None:
            search.free_beside = by_a_step
        search.wrong_record = wrong
        return wrong is not None or search.free_beside is not None

    def _without_runs(self, search: JointSearch, model: FittedModel) -> tuple[Left, ...]:
        """What is left of the others without one run, and without two."""
        return left_without(self.setting, model, program_compiled(search, model.effects))

    def begin_ahead(self, search: JointSearch, present: FittedModel) -> None:
        """What a search ends with is begun by a second process: the model's own programs, if it has nothing else to do, and, once it may soon end, unknown functions that are asked for."""
        if present.effects and is_idle():
            begin_derivatives([search.joint.restricted(present.effects)[0]])  # takes it to its optimum
            begin_finer_integration(self.setting, present.effects, present.values)
        soon = search.thorough and search.rounds_before + len(search.rounds) >= SOON
        if soon and self.asking is None and not self.asked and self._asks(present):
            self.asking = begin_asking(self.setting, search.fitted[()], present.effects)

    def _asks(self, found: FittedModel) -> bool:
        """Whether unknown functions are asked for before a search ends with `found`."""
        few = len(found.effects) < self.setting.config.many_effects
        return bool(found.effects) and not (few and leaves_noise(self.setting, found))

    def before_the_end(self, search: JointSearch, found: FittedModel) -> FittedModel | None:
        """One effect that is likelier than those of `found`, in an equation where an unknown function is likelier than these too."""
        if not self._asks(found):
            return None
        fits = self._asked(search, found).fits
        functions = self._likelier(search, found, () if fits is None else fits.fitted)
        other = self._one_effect(search, found, functions) if functions else None
        return other or (self._one_of_all(search, found) if len(found.effects) >= MANY else None)

    def _one_of_all(self, search: JointSearch, found: FittedModel) -> FittedModel | None:
        """The base model, or one of few effects, with one more that is likelier than the many of `found`. Those that are fitted to their end come first: the others are not fitted again at this error."""
        every = [name for name in search.joint.coefficients if name not in search.excluded]
        described = [] if leaves_noise(self.setting, found) else described_alone(search, found)
        known = {one.effects for one in described}
        others = [one for one in likeliest_alone(search, every, found) if one.effects not in known]
        near = nearest_alone(search, described, found) + nearest_alone(search, others, found)
        return next(iter(self._likelier(search, found, near)), None)

    def _asked(self, search: JointSearch, found: FittedModel) -> AskedFor:
        """Unknown functions beside the base model, whose values of presets are free in them as well. `found`: the likeliest model, beside which they may be asked for when the search has ended."""
        if not self.asked:
            self.asked.append(asked_for(self.setting, search.fitted[()], found.effects, self.asking))
        search.lacking = self.asked[0]
        return self.asked[0]

    def _one_effect(
        self, search: JointSearch, found: FittedModel, functions: Sequence[FittedModel]
    ) -> FittedModel | None:
        """The likeliest base model with one effect of the equations of `functions`, if it is likelier than `found`."""
        equations = {UNKNOWN[model.effects[-1]].candidate.equation for model in functions}
        alike = [name for name in search.joint.coefficients if LIBRARY[name].candidate.equation in equations]
        alone = fitted_alone(
            search, [name for name in alike if name not in search.excluded], search.error(functions[0])
        )
        likelier = self._likelier(search, found, alone)
        return likelier[0] if likelier and likelier[0].effects != found.effects else None

    def _likelier(self, search: JointSearch, found: FittedModel, models: Sequence[FittedModel]) -> list[FittedModel]:
        """Those of `models` that are likelier than `found`, the likeliest first."""
        variance = min(map(search.error, (found, *models))) ** 2
        ahead = [one for one in models if one.log_evidence(variance) > found.log_evidence(variance)]
        return sorted(ahead, key=lambda one: -one.log_evidence(variance))

    def resumed(
        self,
        search: JointSearch,
        found: FittedModel | None = None,
        base: np.ndarray | None = None,
        most: int = LIKELIEST,
    ) -> tuple[JointSearch, FittedModel]:
        """(search, likeliest model) from the `most` likeliest sets that `search` has fitted, with the values of presets free.

        `found`: its likeliest. None: sets that have an excluded effect do not count, and the likeliest of the others is that.
        `base`: values (P,) of the base model; None: those of `search`. Unknowns that `search` did not have begin there as well.
        """
        again = self.joint_search(self.setting.presets)
        again.programs, again.traced = search.programs, search.traced
        starts = self._starts(search, found, most, again.excluded)
        if base is not None:
            # What is held now lies where the base model has it.
            free = set(again.joint.free(tuple(again.joint.coefficients)))
            # An unknown that a corrected record has added was held at none before.
            free -= set(self.setting.unknowns) - set(search.joint.unknowns)
            begin = [name for name in again.joint.slots if name in free and name in search.joint.slots]
            new, old = ([joint.slots[name] for name in begin] for joint in (again.joint, search.joint))
            for effects, values in starts.items():
                starts[effects] = np.array(base)
                starts[effects][new] = values[old]
            starts[()] = nearer_base(again.joint, base, starts[()])
        return again, search_jointly(again, starts)

    def _starts(
        self, search: JointSearch, found: FittedModel | None, most: int, excluded: frozenset[str]
    ) -> dict[tuple[str, ...], np.ndarray]:
        """Values (P,) of the likeliest sets without an `excluded` effect, the base model and each effect of the likeliest alone among them.

        What values of presets say that are free now is taken out of sets: these values come in its place.
        """
        fitted = {effects: model for effects, model in search.fitted.items() if not self.excluded & set(effects)}
        error = search.error(found) if found is not None else min(map(search.error, fitted.values()))
        # `found` first, however likely the others are: it is what the search goes on from.
        order = sorted(fitted.values(), key=lambda model: (model is not found, -model.log_evidence(error**2)))
        likeliest = order[:most]
        alone = [fitted[one,] for one in likeliest[0].effects if (one,) in fitted]
        begun: dict[tuple[str, ...], np.ndarray] = {}
        for model in (fitted[()], *alone, *likeliest):
            effects = search.joint.ordered([one for one in model.effects if one not in excluded])
            begun.setdefault(effects, search.joint.without(model.values, effects))
        return begun

    def exclude(self, effects: Sequence[str], kept: float) -> None:
        """Effects that keep only that share of their gain at half the step."""
        self.excluded |= set(effects)
        self._note("", StepDependent(_joined(effects), kept))

    def note(self, search: JointSearch, done: JointRound) -> None:
        """A round of the joint search, among those of the findings."""
        compared = tuple((_joined(effects), gain, rms) for effects, gain, rms in done.gains)
        if done.best == done.present:
            self._note("", NoLikelierModel(compared))
        else:
            self._note(_joined(done.best), LikelierModel(_joined(done.present), done.best_gain, compared))
        if self.setting.after_round is not None:
            self.setting.after_round(search, search.fitted[done.best])

    def _note(self, chosen: str, reason: Reason) -> None:
        self.setting.note(Round(len(self.setting.rounds) + 1, (), chosen, reason))


def base_alone(setting: Search, base: Fit) -> tuple[JointSearch, Model, Model]:
    """(a search of nothing, base model, the same) before anything is searched, as `search_by_evidence` gives it."""
    search = _Stage(setting, _settings(setting)).joint_search({})
    search.fitted[()] = fitted_model(search.joint, (), base.values, ())
    model = as_model(search, search.fitted[()], search.error_of(()))
    return search, model, model


def search_by_evidence(setting: Search, base: Fit) -> tuple[JointSearch, Model, Model]:
    """(the search, base model, likeliest model). Fills `setting.evidence` and `setting.rounds` on the way."""
    stage = _Stage(setting, _settings(setting))
    return _kept_at_half_step(stage, lambda: stage.searched(base.values))


def search_without(setting: Search, search: JointSearch, effects: Sequence[str]) -> tuple[JointSearch, Model, Model]:
    """As `search_by_evidence`, from the likeliest models that `search` has fitted without any of `effects`.

    What is left of the likeliest set when one effect is taken out is rarely the likeliest without it: the others were chosen beside it.
    """
    stage = _Stage(setting, _settings(setting), {*search.excluded, *effects})
    if search.lacking is not None:
        stage.asked.append(search.lacking)  # of the same base model
    stage.asked_for_records = {True, False}  # no longer, once held-out runs have been looked at
    return _kept_at_half_step(stage, lambda: stage.resumed(search))


def search_again(setting: Search, base: Fit, search: JointSearch) -> tuple[JointSearch, Model, Model]:
    """As `search_by_evidence`, from the likeliest models that `search` has fitted with another integration.

    Which effects these are rarely depends on it; how likely they are does. An effect that did not keep its gain then may keep it now.
    """
    stage = _Stage(setting, _settings(setting))
    return _kept_at_half_step(stage, lambda: stage.resumed(search, base=base.values))


def search_beside_a_record(
    setting: Search, base: Fit, search: JointSearch, effects: Sequence[str]
) -> tuple[JointSearch, Model, Model]:
    """As `search_by_evidence`, from the model with `effects`, which `search` had fitted before the record of a run was corrected, and each of these alone.

    Some of these may have stood in for what was wrong with the record, and what did not is there already.
    """
    if not effects:
        return search_by_evidence(setting, base)
    stage = _Stage(setting, _settings(setting))
    known = search.fitted[search.joint.ordered(effects)]
    return _kept_at_half_step(stage, lambda: stage.resumed(search, known, base.values, most=1))


def _settings(setting: Search) -> FitSettings:
    return FitSettings(tolerance=setting.config.final_convergence, cache=setting.cache, progress=setting.progress)


def _kept_at_half_step(
    stage: _Stage, searched: Callable[[], tuple[JointSearch, FittedModel]]
) -> tuple[JointSearch, Model, Model]:
    """(the search, base model, likeliest model), searched again without effects whose gain half the step does not keep."""
    setting = stage.setting
    while True:
        search, found = searched()
        if search.wrong_record is not None:  # nothing is said of these models: they are fitted again
            error = search.error(found)
            return search, as_model(search, search.fitted[()], error), as_model(search, found, error)
        if setting.begin_wrong_record is not None:
            setting.begin_wrong_record([search.fitted[()], found])
        found = with_no_effect_too_many(search, found)
        error = search.error(found)
        base_model = refined(search, search.fitted[()], search.error_of(()))
        first = as_model(search, base_model, error)
        found = with_no_effect_hardly_needed(search, setting, found, error)
        final = final_model(search, setting, found, error) if found.effects else first
        kept = gain_kept_at_half_step(setting, final, first)
        if kept >= setting.config.gain_kept_at_half_step:
            break
        stage.exclude([name for name in final.effects if LIBRARY[name].candidate.stick_slip], kept)
    probabilities = search.effect_probabilities(error)
    for effect in search.joint.coefficients:
        seen = setting.evidence.setdefault(effect, Evidence())
        seen.probability = probabilities.get(effect, float("nan"))  # in no set that was worth a fit
        if (effect,) in search.fitted:
            seen.alone_rmse = search.fitted[(effect,)].rms
    return search, first, final


def _joined(effects: Sequence[str]) -> str:
    return " + ".join(effects)
