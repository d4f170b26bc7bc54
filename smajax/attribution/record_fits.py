"""Fits of a model with an input of one run, or of two, as it may have been recorded wrongly: late, on another clock, at another level, or with another load than noted.

Each is an effect of the library with a value of that run alone, and an event with the prior odds of one, shared among the runs. It
is fitted together with all parameters of the base model and of the effects beside which it is sought, by one program for all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from smajax.attribution.doubtful_runs import NEAR_NOISE, Left, left_without
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, fitted_model
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.program_fits import comparison_settings
from smajax.core.names_of_runs import of_run
from smajax.core.parameters import parameters
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import PerRun, Problem
from smajax.fit.starts import nearest
from smajax.model.effects.candidate import PRIOR_ODDS
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.extended import with_effects
from smajax.model.system import System

MOST_RUNS = 2  # looked at, those without which least is left of the others: each costs a fit for every kind of error
LEAST_ODDS = 3.0  # in log odds: twenty to one that the record is wrong, before a run is corrected by it
MOST_PAIRS = 3  # of runs that may both be wrong, those without which least is left of the others
AS_LITTLE = 2.0  # times as much: one Gauss-Newton step does not tell them apart
CLOSER = 3.0  # by which a fit is expected to come nearer: what its error is counted in while it runs
MOST_LEFT = 2.0  # noises that the model with the error leaves: of one that leaves more no record is said to be wrong
MOST_SHARES = (
    (4, 0.6),
    (8, 0.3),
    (16, 0.1),
)  # after so many steps a fit ends that leaves more than this share of the squares

FITTING = "inputs of single runs"  # the stage

Host = Model | FittedModel  # a model beside which an error of a record is sought


class Kind(NamedTuple):
    """One way in which a record may be wrong. `sigma`: of its prior about zero, SI. `tried`: where fits begin."""

    coefficient: str
    sigma: float
    tried: tuple[float, ...]
    source: str


KINDS = (
    Kind(
        "input_delay.delay",
        0.3,
        (-0.4, -0.15, -0.03, 0.03, 0.15, 0.4, 0.8, 1.6),
        "a recorder that is started by hand or waits for a trigger: tenths of a second to a second",
    ),
    Kind("input_clock.rate", 0.01, (-0.02, -0.003, 0.003, 0.02), "loops timed by software: up to 1 %"),
    Kind("input_level.gain", 0.1, (-0.2, -0.03, 0.03, 0.2), "a range or a set value that was noted wrongly: 5 to 20 %"),
    Kind("wrong_load.share", 0.1, (-0.2, -0.03, 0.03, 0.2), "a weight that was noted wrongly or added to: 5 to 20 %"),
)


OF_RECORDS = {kind.coefficient.split(".")[0] for kind in KINDS}  # effects that say how a record is wrong


def kind_of(coefficient: str) -> Kind:
    """The way in which a record is wrong that has this coefficient."""
    return next(kind for kind in KINDS if kind.coefficient == coefficient)


@dataclass(frozen=True)
class _EventParameters(JointParameters):
    """Those of a model with one value of one run's own; its problem is whole already."""

    def restricted(self, effects: Sequence[str]) -> tuple[Problem, np.ndarray]:
        own = self.problem
        priors = self.prior_records(effects)
        same = own.with_system(own.system, per_run=own.per_run, priors=priors)
        return same, np.arange(len(own.names))


class Event(NamedTuple):
    """An error of one record, with its size, SI."""

    coefficient: str
    run: str
    value: float

    @property
    def name(self) -> str:
        return of_run(self.coefficient, self.run)


class Fit(NamedTuple):
    """A host with errors of records, fitted. `before`: what the host leaves without them, root mean square, SI."""

    host: Host
    events: tuple[Event, ...]
    model: FittedModel
    before: float


def log_odds(coefficient: str, value: float, standard_error: float, runs: int) -> float:
    r"""Of an error of one record of so many `runs`, over none beside the same model.

    By the density ratio of Savage and Dickey (Dickey 1971) with the posterior taken as normal: $z^2/2 + \ln(s/\sigma)$ with $z = v/s$, value over standard error, and the prior's $\sigma$; and the
    prior odds. A model fitted with an error of a record has the values of presets free as well, and these alone may explain what is missing.
    """
    sigma = kind_of(coefficient).sigma
    return 0.5 * (value / standard_error) ** 2 + math.log(standard_error / sigma) + _prior_odds(runs)


def _prior_odds(runs: int) -> float:
    """Log prior odds of an error of one record, shared among the runs."""
    return math.log(PRIOR_ODDS["event"] / runs)


def needed(fit: Fit, error: float, runs: int) -> bool:
    """Whether each of the errors is likelier than none by `LEAST_ODDS`; `error` of an independent sample, SI, `runs` of the fit."""
    errors = fit.model.standard_errors(error**2)
    return all(log_odds(one.coefficient, one.value, errors[one.name], runs) >= LEAST_ODDS for one in fit.events)


def likeliest(fits: Sequence[Fit], error: float) -> Fit:
    """The one of most evidence; `error` of an independent sample, SI."""
    return max(fits, key=lambda one: one.model.log_evidence(error**2))


@dataclass(frozen=True)
class Beside:
    """A host, and everything that may be wrong with a record of one of its runs: `possible` by their names, such as `input_delay.delay[steps]`."""

    setting: Search
    host: Host
    joint: _EventParameters
    possible: Mapping[str, tuple[Kind, str]]
    left: np.ndarray  # (series, N), misfit of the host, SI

    @classmethod
    def of(cls, setting: Search, host: Host, carried: Sequence[str], runs: Sequence[str]) -> Beside | None:
        """None where no record can be wrong in any of the ways known. `carried`: effects that its program has as well, off."""
        own, slots = setting.restricted((*host.effects, *carried))
        values = host.values[slots]
        problem, kinds = with_record_errors(own, values, runs)
        every = {of_run(kind.coefficient, run): (kind, run) for run in runs for kind in kinds}
        # What was corrected before is a parameter of the base model.
        possible = {name: one for name, one in every.items() if name not in setting.unknowns}
        (left,) = misfits(own, [values])
        return cls(setting, host, _with_events(setting, host, problem, possible), possible, left) if possible else None

    def singly(self) -> list[Fit]:
        """Each kind of error in each of the runs without which the host leaves least of the others."""
        doubtful = self._without[0].groups[:MOST_RUNS]
        return self._fitted(
            [(name,) for (run,) in doubtful for name in self._of(run)], self.joint.problem.start_values()
        )

    def in_two_runs(self, singly: Sequence[Fit], error: float) -> list[Fit]:
        """Errors in two runs at once, where much less is left without some two than with them; `error` of an independent sample, SI.

        The likeliest single error of the runs in question, beside it all of the others that may be the second, and beside the likeliest of these all of the first run.
        """
        noise = float(self.setting.problem.noise_sigma)
        if len(self._without) < 2 or self._before < NEAR_NOISE * noise:
            return []
        left = self._without[1]
        if not left.stands_out:
            return []
        pairs = [
            pair for pair, after in zip(left.groups, left.after, strict=True) if after <= AS_LITTLE * left.after[0]
        ]
        runs = dict.fromkeys(run for pair in pairs[:MOST_PAIRS] for run in pair)
        known = {fit.events[0].name: fit for fit in singly}
        names = {name: run for run in runs for name in self._of(run)}
        fresh = [(name,) for name in names if name not in known]
        known |= {fit.events[0].name: fit for fit in self._fitted(fresh, self.joint.problem.start_values())}
        tried = [known[name] for name in names if name in known]
        if not tried:
            return []
        first = likeliest(tried, error)
        kept = first.events[0].name
        beside = {run for pair in pairs[:MOST_PAIRS] if names[kept] in pair for run in pair} - {names[kept]}
        second = self._fitted([(kept, name) for name, run in names.items() if run in beside], first.model.values)
        if not second:
            return []
        best = likeliest(second, error)
        again = [name for name, run in names.items() if run == names[kept] and name != kept]
        return [*second, *self._fitted([(best.events[1].name, name) for name in again], best.model.values)]

    @cached_property
    def _without(self) -> tuple[Left, ...]:
        """What the host leaves of the other runs without each run, and without each two."""
        return left_without(self.setting, self.host)

    @cached_property
    def _before(self) -> float:
        """What the host leaves, root mean square, SI."""
        return float(np.sqrt((self.left**2).sum() / np.asarray(self.joint.problem.batch.mask).sum()))

    def _of(self, run: int) -> list[str]:
        """What may be wrong with the records of that fit run."""
        name = self.joint.problem.per_run.runs[run]
        return [event for event, (_, own) in self.possible.items() if own == name]

    def _fitted(self, sets: Sequence[tuple[str, ...]], values: np.ndarray) -> list[Fit]:
        """Sets of errors, from `values` (P,); the last of each begins at all its tried sizes, and what is in none of a set is zero."""
        if not sets:
            return []
        setting, joint, host = self.setting, self.joint, self.host
        count = float(np.asarray(joint.problem.batch.mask).sum())
        noise, squares = float(setting.problem.noise_sigma), float((self.left**2).sum())
        error = max(noise, float(np.sqrt(np.mean(self.left**2))) / CLOSER)
        problem, _ = joint.restricted([*host.effects, *self.possible])
        problem = problem.with_noise(error)
        groups = []
        for names in sets:
            point = np.array(values)
            point[[joint.slots[name] for name in self.possible if name not in names]] = 0.0
            at = np.arange(len(point)) == joint.slots[names[-1]]
            groups.append([np.where(at, size, point) for size in self.possible[names[-1]][0].tried])
        tasks = [
            problem.task(joint.free((*host.effects, *names)), joint.bounds, begun)
            for names, begun in zip(sets, nearest(problem, groups), strict=True)
        ]
        settings = FitSettings(cache=setting.cache, progress=setting.progress)
        settings = comparison_settings(settings, FITTING)
        # Of a wrong record there is noise left when it is right; what comes nowhere near that in a few steps is none.
        allowed = (MOST_LEFT * noise / error) ** 2 * count
        excess = tuple((steps, max(share * squares / error**2, allowed)) for steps, share in MOST_SHARES)
        settings = replace(settings, allowed_excess=excess, least_cost=0.0, promised_excess=None, one_of_each=0)
        found = []
        for names, fit in zip(sets, levenberg_marquardt(problem, tasks, settings), strict=True):
            if not np.isfinite(fit.cost):
                continue
            events = [
                Event(self.possible[name][0].coefficient, self.possible[name][1], float(fit.values[joint.slots[name]]))
                for name in names
            ]
            model = fitted_model(joint, (*host.effects, *names), fit.values, ())
            found.append(Fit(host, tuple(events), model, self._before))
        return found


def with_record_errors(own: Problem, values: np.ndarray, runs: Sequence[str]) -> tuple[Problem, list[Kind]]:
    """(`own` at `values` (P,) with every error of a record, at none; the kinds of these)."""
    here = jnp.asarray(values)
    system, known = own.system_at(here), own.per_run.names
    kinds = [kind for kind in KINDS if kind.coefficient in own.per_run.single or _possible(kind, system)]
    fresh = [kind.coefficient for kind in kinds if kind.coefficient not in known]
    whole = with_effects(system, [name.split(".")[0] for name in fresh])
    start = jnp.asarray(np.concatenate([own.per_run_at(here), np.zeros((len(runs), len(fresh)))], axis=1))
    return own.with_system(whole, per_run=PerRun((*known, *fresh), tuple(runs), start, own.per_run.single)), kinds


def _possible(kind: Kind, system: System) -> bool:
    """Whether a record of this system can be wrong in that way, and is not already taken to be."""
    effect = kind.coefficient.split(".")[0]
    return effect not in {one.effect_name for one in system.effects} and LIBRARY[effect].candidate.applies(system)


def _with_events(
    setting: Search, host: Host, problem: Problem, events: Mapping[str, tuple[Kind, str]]
) -> _EventParameters:
    """Parameters of models with the effects of `host` and some of `events`, with their priors."""
    plain = setting.joint(host.effects)
    table = parameters(problem.system)
    odds = _prior_odds(problem.batch.runs)
    return _EventParameters(
        problem,
        plain.unknowns,
        {
            **plain.bounds,
            **{name: (table[kind.coefficient].low, table[kind.coefficient].high) for name, (kind, _) in events.items()},
        },
        {**plain.coefficients, **{name: (name,) for name in events}},
        {**plain.priors, **{name: CoefficientPrior(0.0, kind.sigma, False) for name, (kind, _) in events.items()}},
        {**plain.log_odds, **dict.fromkeys(events, odds)},
    )
