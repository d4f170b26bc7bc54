"""Parameters of the joint fit: the experiment's unknowns, and the coefficients of all candidate effects with their priors.

A coefficient is counted in widths of its prior from its base value, so that the numbers of all coefficients compare.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from smajax.attribution.declared_priors import NONE_DECLARED, overridden
from smajax.data.experiment.record import DeclaredPriors, Prior
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import sensitivity
from smajax.model.effects.candidate import PRIOR_ODDS, Extent
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior, width_of
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import force_at_rest

NUDGE = 5e-4  # widths: how far an effect is switched on where its trace is taken; at zero some have no slope
RANGES = 1.0  # width of an unknown without a prior, in ranges between its bounds: it lies within them


@dataclass(frozen=True)
class JointParameters:
    """Which parameters a joint fit has, within which bounds, and what is known of them before it."""

    problem: Problem
    unknowns: tuple[str, ...]  # those of the experiment, and the values of presets that the runs may correct
    bounds: Mapping[str, tuple[float, float]]
    coefficients: Mapping[str, tuple[str, ...]]  # of each candidate effect, by full name
    priors: Mapping[
        str, CoefficientPrior
    ]  # of every coefficient, of the values of presets, and of unknowns that have one
    log_odds: Mapping[str, float]  # of each effect, before the runs were seen
    width_factors: Mapping[str, float] = field(
        default_factory=dict
    )  # of effects whose priors are wider than their files say

    @classmethod
    def of(
        cls,
        problem: Problem,
        unknowns: Sequence[str],
        bounds: Mapping[str, tuple[float, float]],
        candidates: Sequence[str],
        extent: Extent,
        presets: Mapping[str, CoefficientPrior] = MappingProxyType({}),
        declared: DeclaredPriors = NONE_DECLARED,
        of_unknowns: Mapping[str, CoefficientPrior] = MappingProxyType({}),
    ) -> JointParameters:
        """Of a problem whose model carries all `candidates` at their base values.

        `presets`: of `preset_priors`. `declared`: by the experiment file, in the place of what the effects say. `of_unknowns`: by
        that file as well, of those unknowns that have one.
        """
        at_rest = _load_at_rest(problem)
        coefficients, log_odds = {}, {}
        priors = {**of_unknowns, **presets}
        for effect in candidates:
            kind = LIBRARY[effect]
            names = tuple(name for name in problem.names if name.startswith(f"{effect}."))
            coefficients[effect] = names
            log_odds[effect] = math.log(declared.odds.get(effect, PRIOR_ODDS[kind.candidate.prior_class]))
            for name in names:
                own = width_of(kind, name.split(".", 1)[1], bounds[name], extent, at_rest)
                priors[name] = overridden(own, declared.coefficients.get(name), bounds[name])
        return cls(problem, (*unknowns, *presets), bounds, coefficients, priors, log_odds)

    @property
    def described(self) -> tuple[object, ...]:
        """All that it holds beside the problem, for the key of a cached result."""
        maps = self.bounds, self.coefficients, self.priors, self.log_odds, self.width_factors
        return self.unknowns, *(dict(one) for one in maps)

    @cached_property
    def slots(self) -> dict[str, int]:
        """Place of every parameter in the vector of all."""
        return {name: slot for slot, name in enumerate(self.problem.names)}

    def switches(self, effect: str) -> tuple[str, ...]:
        """Coefficients that are zero where the effect is off, by full name."""
        return tuple(f"{effect}.{name}" for name in LIBRARY[effect].candidate.switches)

    def free(self, effects: Sequence[str]) -> list[str]:
        """Every free parameter of a model with `effects`, the unknowns first."""
        return [*self.unknowns, *(name for effect in effects for name in self.coefficients[effect])]

    def one_sided(self, name: str) -> bool:
        """Whether a coefficient cannot fall below its base value: its prior is half a normal distribution."""
        prior = self.priors.get(name)
        return prior is not None and not prior.logarithmic and self.bounds[name][0] >= prior.base

    def scale(self, name: str, value: float) -> float:
        """What one width of the prior (one range, of an unknown without one) is at `value`, in the parameter's unit."""
        prior = self.priors.get(name)
        if prior is None:
            low, high = self.bounds[name]
            return high - low
        return prior.sigma * value if prior.logarithmic else prior.sigma

    def deviation(self, name: str, value: float) -> float:
        """Widths from the base value; 0 of an unknown without a prior."""
        prior = self.priors.get(name)
        return 0.0 if prior is None else prior.deviation(value)

    def precision(self, name: str) -> float:
        """Of the prior, per squared width."""
        return self._factor(name) ** -2 if name in self.priors else RANGES**-2

    def _factor(self, name: str) -> float:
        """By how much the prior of a coefficient is wider than its width."""
        return self.width_factors.get(name.split(".")[0], 1.0)

    def restricted(self, effects: Sequence[str]) -> tuple[Problem, np.ndarray]:
        """The same runs by a model that carries, of the candidates, only `effects`, with priors; where its parameters are in ours.

        An effect that is off costs time in every step.
        """
        own = self.problem.system
        fitted_ones = tuple(
            one for one in own.effects if one.effect_name in effects or one.effect_name not in self.coefficients
        )
        system = dataclasses.replace(own, effects=fitted_ones)
        problem = self.problem.with_system(system, priors=self.prior_records(effects))
        return problem, np.asarray([self.slots[name] for name in problem.names])

    def prior_records(self, effects: Sequence[str]) -> dict[str, Prior]:
        """Priors of the free parameters of a model with `effects`, for a fit."""
        return {
            name: Prior(one.base, one.sigma * self._factor(name), one.logarithmic)
            for name in self.free(effects)
            if (one := self.priors.get(name)) is not None
        }

    def without(self, values: np.ndarray, effects: Sequence[str]) -> np.ndarray:
        """`values` (P,) with all coefficients of the effects that are not in `effects` at their base."""
        changed = np.array(values)
        for effect, names in self.coefficients.items():
            if effect not in effects:
                changed[[self.slots[name] for name in names]] = [self.priors[name].base for name in names]
        return changed

    def ordered(self, effects: Sequence[str]) -> tuple[str, ...]:
        """`effects` in the order of the library, in which they act on the model."""
        return tuple(effect for effect in self.coefficients if effect in effects)


def _load_at_rest(problem: Problem) -> float:
    """Force of the load at its start, mean of the runs, N (N m on an arm); 0 of a coupon."""
    load = problem.system.load
    if not isinstance(load, AbstractMovingLoad):
        return 0.0
    inputs = {name: np.asarray(series) for name, series in problem.batch.inputs.items()}
    forces = [
        float(force_at_rest(load, {name: series[run, 0] for name, series in inputs.items()}))
        for run in range(problem.batch.runs)
    ]
    return float(np.mean(forces))


def residual_and_columns(
    problem: Problem, values: np.ndarray, names: Sequence[str]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(measured minus predicted, derivative of the prediction by each of `names`), on the measured samples, SI."""
    at = sensitivity(problem, np.asarray(values), names)
    keep, noise = at.mask > 0, np.asarray(problem.noise)
    columns = {name: -(at.jacobian[..., k] * noise)[keep] for k, name in enumerate(names)}
    return (at.misfit * noise)[keep], columns
