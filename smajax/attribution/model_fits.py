"""Fits of one experiment by models with some effects of the library, and whether what they leave is noise."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.attribution.declared_priors import NONE_DECLARED
from smajax.attribution.every_effect import EVERY
from smajax.attribution.findings import Round
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.reasons import Reason
from smajax.attribution.record_error import FoundRecordErrors
from smajax.attribution.residual_diagnostics import noise_by_output
from smajax.attribution.run_extent import extent_of
from smajax.attribution.score_test import switches
from smajax.core.progress import Progress, Result, quiet
from smajax.core.result_cache import ResultCache
from smajax.core.whiteness import split_runs
from smajax.data.experiment.record import DeclaredPriors, Prior
from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import RunBatch
from smajax.fit.problem import Problem
from smajax.fit.starts import multistart, perturbed_restarts
from smajax.fit.uncertainty import at_bound
from smajax.model.effects.candidate import Extent
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior

DEFAULT = AttributionConfig()


@dataclass(frozen=True)
class Start:
    """Where one fit begins: the effects whose coefficients are free, all parameters, and how much each run counts."""

    effects: tuple[str, ...]
    values: np.ndarray  # (P,), in the order of the whole library's problem
    weights: np.ndarray | None = None  # of the runs, (R,); None: all alike
    goal: float = math.inf  # as of `FitTask`


@dataclass(frozen=True)
class Model:
    """A set of effects with fitted values, and how it does on runs left out."""

    effects: tuple[str, ...]
    values: np.ndarray  # (P,)
    cost: float
    left_out: np.ndarray  # misfit (SI) of each fit run by the model fitted to the others, (R, N)
    left_out_rmse: float
    left_out_values: np.ndarray | None = None  # (parts, P): fitted without each part of the runs
    width_factors: Mapping[str, float] = field(default_factory=dict)  # of the effects' priors (`laplace_evidence`)


@dataclass
class Evidence:
    """What was learnt of one effect over the whole search."""

    alone_rmse: float = float("nan")  # fit runs, base model with the effect alone
    probability: float = float("nan")  # posterior, of the fitted sets that have it


@dataclass
class Search:
    """The search's settings, and what it has found so far."""

    problem: Problem
    unknowns: tuple[str, ...]
    bounds: Mapping[str, tuple[float, float]]
    candidates: tuple[str, ...]
    cache: ResultCache
    progress: Progress = quiet
    noise_given: bool = True  # of every output by the experiment file; else estimated
    noises_given: tuple[bool, ...] = ()  # of each output; none: as `noise_given`
    held_out: RunBatch | None = None  # which no fit sees, and which refuse an unknown term in the end
    held_out_runs: tuple[str, ...] = ()  # their names
    config: AttributionConfig = DEFAULT
    evidence: dict[str, Evidence] = field(default_factory=dict)
    rounds: list[Round] = field(default_factory=list)
    presets: Mapping[str, CoefficientPrior] = field(default_factory=dict)  # values that the user did not give
    declared: DeclaredPriors = NONE_DECLARED  # priors by the experiment file
    of_unknowns: Mapping[str, CoefficientPrior] = field(default_factory=dict)  # the same of unknowns that have one
    # Gets a joint search and its likeliest model (`FittedModel`) after each of its rounds.
    after_round: Callable[[Any, Any], object] | None = None
    # An input of one run that was recorded wrongly, beside some models, in the place of one that the search has come to; None: it is not asked for.
    wrong_record: Callable[[Sequence[Any], Any], FoundRecordErrors | None] | None = None
    # Has what that asks beside some models made ready by a second process.
    begin_wrong_record: Callable[[Sequence[Any]], None] | None = None

    def alone(self) -> Search:
        """The same settings for a second process, which reports nothing and records no rounds."""
        return dataclasses.replace(
            self,
            cache=self.cache.alone(),
            progress=quiet,
            evidence={},
            rounds=[],
            after_round=None,
            wrong_record=None,
            begin_wrong_record=None,
        )

    def note(self, done: Round) -> None:
        """Record a round and report it."""
        self.rounds.append(done)
        self.progress(Result(done))

    def set_aside(self, model: Model, reason: Reason, effects: Sequence[str] = ()) -> None:
        """Note a round in which `effects` are removed, or all that was added."""
        tried = ((" + ".join(model.effects), model.left_out_rmse),)
        self.note(Round(len(self.rounds) + 1, tried, " + ".join(effects or model.effects), reason, removed=True))

    def free(self, effects: Sequence[str]) -> list[str]:
        """Every free parameter of a model with `effects`."""
        return [*self.unknowns, *(name for effect in effects for name in self.coefficients(effect))]

    def loose(self, effects: Sequence[str], values: np.ndarray) -> list[str]:
        """Those of them that no bound holds at `values`."""
        place = self.problem.names.index
        return [name for name in self.free(effects) if not at_bound(float(values[place(name)]), *self.bounds[name])]

    @cached_property
    def extent(self) -> Extent:
        """How far the runs go; reading the levels of a log takes a while."""
        return extent_of(self.problem)

    @property
    def every(self) -> list[str]:
        """Unknowns and all coefficients of all candidates: one Jacobian serves every question."""
        return self.free(self.candidates)

    def joint(self, effects: Sequence[str], presets: Mapping[str, CoefficientPrior] | None = None) -> JointParameters:
        """Parameters of joint fits of models with some of `effects`. `presets`: those of the search, unless others are given."""
        free = self.presets if presets is None else presets
        own = self.declared, self.of_unknowns
        return JointParameters.of(self.problem, self.unknowns, self.bounds, effects, self.extent, free, *own)

    def prior_records(
        self,
        presets: bool,
        level: float = 1.0,
        effects: Sequence[str] = (),
        width_factors: Mapping[str, float] = MappingProxyType({}),
    ) -> dict[str, Prior]:
        """Priors for a fit whose misfit counts in noises: of unknowns, of values of presets where these are free, and of those `effects` that keep theirs.

        `level`: noises that an independent sample may be off by, beside which a prior counts as it would beside the noise alone.
        `width_factors`: by how much those of effects are wider than their files say.
        """
        known = {**self.of_unknowns, **(self.presets if presets else {})}
        records = {name: Prior(one.base, one.sigma / level, one.logarithmic) for name, one in known.items()}
        keeping = [name for name in effects if LIBRARY[name].candidate.keeps_priors and name in self.candidates]
        if keeping:
            joint = dataclasses.replace(self.joint(keeping), width_factors=width_factors)
            own = joint.prior_records(keeping)
            for name in (name for effect in keeping for name in joint.coefficients[effect]):
                records[name] = dataclasses.replace(own[name], sigma=own[name].sigma / level)
        return records

    def coefficients(self, effect: str) -> list[str]:
        return [name for name in self.problem.names if name.startswith(f"{effect}.")]

    def inside(self, model: Model) -> np.ndarray:
        """The values of `model`, with the free ones that lie at a bound moved off it."""
        values = np.array(model.values)
        for name in self.free(model.effects):
            low, high = self.bounds[name]
            room, place = self.config.bound_distance * (high - low), self.problem.names.index(name)
            values[place] = np.clip(values[place], low + room, high - room)
        return values

    def restricted(
        self, effects: Sequence[str], priors: Mapping[str, Prior] = MappingProxyType({})
    ) -> tuple[Problem, list[int]]:
        """The same runs with a model that carries, of the candidates, only `effects`; where its parameters are in ours.

        What is not in play costs nothing in a fit. `priors` of parameters that a fit frees.
        """
        gone = set(self.candidates) - set(effects)
        kept = tuple(effect for effect in self.problem.system.effects if effect.effect_name not in gone)
        system = dataclasses.replace(self.problem.system, effects=kept)
        own = self.problem
        problem = own.with_system(system, priors=priors)
        return problem, [self.problem.names.index(name) for name in problem.names]

    def fit(
        self,
        starts: Sequence[Start],
        what: str,
        *,
        enough: float | None = None,
        settled: float = 0.0,
        hops: bool = False,
        presets: bool = False,
        level: float = 1.0,
        width_factors: Mapping[str, float] = MappingProxyType({}),
    ) -> tuple[list[Fit], np.ndarray]:
        """Fit every start: (fits with full parameter vectors, misfit of all runs at each, (S, R, N)).

        `enough`, `settled`: relative and absolute tolerance of the cost. `hops`: each from points near its end as well
        (`fit.starts.perturbed_restarts`). `presets`: whether values of presets are free, within their priors against the noise.
        `level`, `width_factors`: as of `prior_records`.
        """
        enough = self.config.convergence if enough is None else enough
        freed = self.presets if presets else {}
        every = [name for start in starts for name in start.effects]
        problem, index = self.restricted(every, self.prior_records(presets, level, every, width_factors))
        tasks = [
            problem.task([*self.free(start.effects), *freed], self.bounds, start.values[index], start.weights)._replace(
                goal=start.goal
            )
            for start in starts
        ]
        settings = FitSettings(
            tolerance=enough, absolute_tolerance=settled, cache=self.cache, progress=self.progress, stage=what
        )
        fits = levenberg_marquardt(problem, tasks, settings)
        if hops:
            fits = perturbed_restarts(problem, tasks, fits, settings)
        found = misfits(problem, [one.values for one in fits])
        return [self.whole(one, start.values, index) for start, one in zip(starts, fits, strict=True)], found

    def base(self, start: np.ndarray, seed: int) -> Fit:
        """The base model fitted, from `start` and from many points of its box."""
        problem, index = self.restricted((), self.prior_records(presets=False))
        here = eqx.tree_at(lambda one: one.system, problem, problem.system_at(jnp.asarray(start[index])))
        fits = multistart(
            here,
            self.unknowns,
            self.bounds,
            seed,
            settings=FitSettings(
                tolerance=self.config.convergence,
                cache=self.cache,
                progress=self.progress,
                stage="fitting the base model",
            ),
        )
        return self.whole(fits[0], start, index)

    def whole(self, found: Fit, start: np.ndarray, index: Sequence[int]) -> Fit:
        """A fit of a restricted problem with the parameters of the whole library's."""
        values = np.array(start)
        values[np.asarray(index)] = found.values
        return dataclasses.replace(found, values=values)

    def is_noise(self, model: Model) -> bool:
        """Whether what a model leaves of the fit runs is measurement noise."""
        problem, index = self.restricted(model.effects)
        (misfit,) = misfits(problem, [model.values[index]])
        return self.all_noise(misfit, np.asarray(problem.batch.mask))

    def all_noise(self, misfit: np.ndarray, mask: np.ndarray) -> bool:
        """Whether a misfit is measurement noise in every output, as far as `mask` goes; both (series, N), of whole runs."""
        return all(self.noise_by_output(misfit, mask))

    def noise_by_output(self, misfit: np.ndarray, mask: np.ndarray) -> list[bool]:
        """The same of each output by itself: what one leaves is not made up for by another that leaves less than its noise."""
        count, sigma = len(self.problem.batch.outputs), float(self.problem.noise_sigma)
        given = self.noises_given or (self.noise_given,) * count
        series = [split_runs(misfit[k::count], mask[k::count]) for k in range(count)]
        return noise_by_output(series, sigma, given, self.config)

    def rmse(self, misfit: np.ndarray) -> float:
        return float(np.sqrt((misfit**2).sum() / np.asarray(self.problem.batch.mask).sum()))

    def explained_variance(self, left_out_rmse: float) -> float:
        """Share of the mean square of the motion in the fit runs, each about its mean, that a left-out error leaves explained."""
        mask = np.asarray(self.problem.batch.mask)
        measured = self.problem.measured * self.problem.scale_of_series
        mean = (measured * mask).sum(axis=1, keepdims=True) / np.maximum(mask.sum(axis=1, keepdims=True), 1.0)
        motion = self.rmse((measured - mean) * mask)
        return 1.0 - (left_out_rmse / motion) ** 2 if motion > 0.0 else 1.0

    def predicts(self, left_out_rmse: float) -> bool:
        """Whether a model with that error explains enough of these runs for its effects to mean anything, where it leaves more than noise."""
        return self.explained_variance(left_out_rmse) > self.config.least_explained_variance


def base_value(coefficient: str) -> float:
    """The value at which a coefficient such as `latent_heat.enthalpy` changes nothing."""
    effect, name = coefficient.split(".", 1)
    return float(getattr(EVERY[effect].base(), name))


def nudged(setting: Search, values: np.ndarray, effects: Sequence[str]) -> np.ndarray:
    """`values` with `effects` switched on by next to nothing.

    A transformation with a tail follows its curve where one without rests, so at exactly zero the coefficient of a tail
    has no derivative there.
    """
    found = np.array(values)
    for effect in effects:
        for name in switches(effect):
            found[setting.problem.names.index(name)] += (
                setting.config.nudge * LIBRARY[effect].candidate.initial_guess[name.removeprefix(f"{effect}.")]
            )
    return found
