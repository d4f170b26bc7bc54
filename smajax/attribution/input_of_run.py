"""An input that was recorded wrongly in one run: late, on another clock, at another level, or with another load than noted.

Each is an effect of the library with a value of that run alone, and an event with the prior odds of one, shared among the runs. It
is fitted together with all parameters of the base model and of the likeliest model, in the runs without which least is left of the others, and
compared by its evidence as sets of effects are. Asked only where something is missing. Where one is likelier, and explains what was
missing, `close-loop` goes on with the run corrected by it (`corrected`): what the search named in its place was a stand-in. How large it is stays
an unknown of that run: the first value was found beside stand-ins, and held there it made others needed.

A model that leaves far more than noise lacks something else as well, and an error of a record is the first thing to take a part of it
over: on a bench of which the best model leaves 12 noises, a clock that was half a second late at its end in one run was
likelier than none by more than twenty to one, and the effects found beside it were worse on a held-out run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from smajax.attribution.findings import ParameterFinding
from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.laplace_evidence import FittedModel, fitted_model, independent_error
from smajax.attribution.leave_one_run_out import left_of_the_others
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.program_fits import comparison_settings
from smajax.attribution.record_error import FoundRecordError, RecordError
from smajax.core.names_of_runs import of_run
from smajax.core.parameters import parameters
from smajax.data.experiment.record import Experiment, Prior, Run, Unknown
from smajax.fit.base_model import base_model
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.problem import PerRun, Problem
from smajax.fit.starts import nearest
from smajax.model.effects.candidate import PRIOR_ODDS
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.extended import with_effects
from smajax.model.system import System, recorded_apart

MOST_RUNS = 2  # looked at, those without which least is left of the others: each costs a fit for every kind of error
LEAST_ODDS = 3.0  # in log odds: twenty to one that the record is wrong, before a run is corrected by it
CLOSER = 3.0  # by which a fit is expected to come nearer: what its error is counted in while it runs
MOST_LEFT = 2.0  # noises that the model with the error leaves: of one that leaves more no record is said to be wrong
FAR_LESS = 4.0  # times that what the present model leaves before a search has ended: what is missing may be what it has not come to yet
SHARE_OF_ONE = (
    4.0  # times less than the base model that one value of one run leaves of all runs, to be corrected on trial
)
MOST_SHARES = (
    (4, 0.6),
    (8, 0.3),
    (16, 0.1),
)  # after so many steps a fit ends that leaves more than this share of the squares
LEAST_RUNS = 3  # of two runs that disagree either may be the wrong one


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


@dataclass(frozen=True)
class _EventParameters(JointParameters):
    """Those of a model with one value of one run's own; its problem is whole already."""

    def restricted(self, effects: Sequence[str]) -> tuple[Problem, np.ndarray]:
        own = self.problem
        priors = self.prior_records(effects)
        same = own.with_system(own.system, per_run=own.per_run, priors=priors)
        return same, np.arange(len(own.names))


def record_error(
    setting: Search,
    hosts: Sequence[Host],
    present: Host,
    runs: Sequence[Run],
    times_less: float | None = None,
    on_trial: bool = False,
) -> FoundRecordError | None:
    """The likeliest error of the record of one fit run, where it is likelier than `present` by `LEAST_ODDS`; `runs` of the fit, in order.

    It is sought beside each of `hosts`, in the place of all effects that `present` has beside theirs. `times_less`: by which the model with it leaves less at least; None: it may leave as much.
    `on_trial`: one that leaves more than noise is given as well where it alone explains nearly all that the base model leaves: what is left may be a second one, and effects that are found beside it.
    """
    if len(runs) < LEAST_RUNS:
        return None
    fits = [one for host in hosts for one in _fits(setting, host, [run.name for run in runs])]
    if not fits:
        return None
    joint = setting.joint(setting.candidates)
    here = fitted_model(joint, present.effects, present.values, present.effects)
    best = min([here, *(one.model for one in fits)], key=lambda model: model.rms)
    error = independent_error(best, float(setting.problem.noise_sigma), setting.noise_given)
    much = MOST_LEFT * float(setting.problem.noise_sigma)

    def likeliest(of: Sequence[_Fit]) -> _Fit | None:
        likelier = max(of, key=lambda one: one.model.log_evidence(error**2), default=None)
        if likelier is None or likelier.model.log_evidence(error**2) - here.log_evidence(error**2) < LEAST_ODDS:
            return None
        return likelier

    found = likeliest(fits)
    tried = (
        found is None or found.model.rms > much or (times_less is not None and found.model.rms > here.rms / times_less)
    )
    if tried:
        found = likeliest([one for one in fits if not one.host.effects]) if on_trial else None
        if found is None or found.model.rms > found.before / SHARE_OF_ONE:
            return None
    assert found is not None
    ahead = found.model.log_evidence(error**2) - here.log_evidence(error**2)
    run = next(one for one in runs if one.name == found.event.run)
    wrong = RecordError(
        run.name,
        _channel(setting.problem.system, found.event.coefficient, run),
        found.event.coefficient,
        found.event.value,
        found.model.standard_errors(error**2)[found.event.name],
        ahead,
        tuple(effect for effect in present.effects if effect not in found.host.effects),
        float(run.time[-1] - run.time[0]),
        tried,
    )
    return FoundRecordError(wrong, found.host.effects)


class _Event(NamedTuple):
    coefficient: str
    run: str
    value: float

    @property
    def name(self) -> str:
        return f"{self.coefficient}[{self.run}]"


class _Fit(NamedTuple):
    """One error of a record beside one host. `before`: what the host leaves without it, root mean square, SI."""

    host: Host
    event: _Event
    model: FittedModel
    before: float


def _fits(setting: Search, host: Host, runs: Sequence[str]) -> list[_Fit]:
    """`host` with each kind of error in each of the runs without which it leaves least of the others, fitted."""
    own, slots = setting.restricted(host.effects)
    system = own.system_at(jnp.asarray(host.values[slots]))
    kinds = [kind for kind in KINDS if _possible(kind, system)]
    if not kinds:
        return []
    whole = with_effects(system, [kind.coefficient.split(".")[0] for kind in kinds])
    as_it_was = own.per_run_at(jnp.asarray(host.values[slots]))
    start = jnp.concatenate([as_it_was, jnp.zeros((len(runs), len(kinds)))], axis=1)
    names = (*own.per_run.names, *(kind.coefficient for kind in kinds))
    per_run = PerRun(names, tuple(runs), start, own.per_run.single)
    problem = own.with_system(whole, per_run=per_run)
    (left,) = misfits(own, [host.values[slots]])
    doubtful = _least_left_without(setting, host)[:MOST_RUNS]
    events = {of_run(kind.coefficient, runs[run]): (kind, runs[run]) for run in doubtful for kind in kinds}
    joint = _with_events(setting, host, problem, events)
    groups = []
    for name, (kind, _) in events.items():
        at, point = joint.slots[name], problem.start_values()
        groups.append([np.where(np.arange(len(point)) == at, value, point) for value in kind.tried])
    error = max(float(own.noise_sigma), float(np.sqrt(np.mean(left**2))) / CLOSER)
    joint_problem, _ = joint.restricted([*host.effects, *events])
    joint_problem = joint_problem.with_noise(error)
    tasks = [
        joint_problem.task(joint.free((*host.effects, name)), joint.bounds, begun)
        for name, begun in zip(events, nearest(joint_problem, groups), strict=True)
    ]
    settings = FitSettings(cache=setting.cache, progress=setting.progress)
    settings = comparison_settings(settings, "inputs of single runs")
    # Of a wrong record there is noise left when it is right; what comes nowhere near that in a few steps is none.
    squares = float((left**2).sum()) / error**2
    allowed = (MOST_LEFT * float(own.noise_sigma) / error) ** 2 * float(np.asarray(own.batch.mask).sum())
    excess = tuple((steps, max(share * squares, allowed)) for steps, share in MOST_SHARES)
    settings = replace(settings, allowed_excess=excess, least_cost=0.0, promised_excess=None, one_of_each=0)
    fits = levenberg_marquardt(joint_problem, tasks, settings)
    before = float(np.sqrt((left**2).sum() / np.asarray(own.batch.mask).sum()))
    return [
        _Fit(
            host,
            _Event(kind.coefficient, run, float(fit.values[joint.slots[name]])),
            fitted_model(joint, (*host.effects, name), fit.values, ()),
            before,
        )
        for (name, (kind, run)), fit in zip(events.items(), fits, strict=True)
    ]


def _least_left_without(setting: Search, host: Host) -> np.ndarray:
    """The fit runs (runs,) by how little `host` leaves of the others without them, the least first.

    A fit to all runs shares the error of one record out: the run that it leaves most of is often another one.
    """
    joint = setting.joint(setting.candidates)
    model = fitted_model(joint, host.effects, host.values, host.effects)
    _, after = left_of_the_others(joint, model, max(float(setting.problem.noise_sigma), model.rms), host.effects)
    return np.argsort(after, kind="stable")


def _possible(kind: Kind, system: System) -> bool:
    """Whether a record of this system can be wrong in that way, and is not already taken to be."""
    effect = kind.coefficient.split(".")[0]
    return effect not in {one.effect_name for one in system.effects} and LIBRARY[effect].candidate.applies(system)


def _with_events(
    setting: Search, host: Host, problem: Problem, events: Mapping[str, tuple[Kind, str]]
) -> _EventParameters:
    """Parameters of models with the effects of `host` and one of `events`, with their priors."""
    plain = setting.joint(host.effects)
    table = parameters(problem.system)
    odds = math.log(PRIOR_ODDS["event"] / problem.batch.runs)
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


def _channel(system: System, coefficient: str, run: Run) -> str:
    """The input of `run` that a coefficient says something of; "load" where none of its inputs is the load."""
    if coefficient.startswith("wrong_load"):
        return next((name for name in ("mass", "stress") if name in run.inputs), "load")
    return next(name for name in sorted(recorded_apart(system)) if name in run.inputs)


def corrected(experiment: Experiment, found: RecordError) -> Experiment:
    """The experiment with one run as it should have been recorded: the effect in the base model, off in all other runs.

    Its size in that run is an unknown that begins at what was found.
    """
    kind = next(one for one in KINDS if one.coefficient == found.coefficient)
    table = parameters(with_effects(base_model(experiment), [found.coefficient.split(".")[0]]))
    about = table[found.coefficient]
    low, high = min(about.low, found.value), max(about.high, found.value)
    prior = Prior(0.0, kind.sigma, False)
    unknown = Unknown(found.coefficient, about.unit, low, high, found.value, True, prior, (found.run,))
    return replace(
        experiment,
        unknowns=(*experiment.unknowns, unknown),
        parameters={**experiment.parameters, found.coefficient: 0.0},
    )


def as_fitted(found: RecordError, after: Sequence[ParameterFinding]) -> RecordError:
    """The error as the final model has it, of which `after` are the parameters."""
    own = next((one for one in after if one.name == of_run(found.coefficient, found.run)), None)
    if own is None:
        return found
    error = found.standard_error if own.standard_error is None else own.standard_error
    return replace(found, value=own.value, standard_error=error)
