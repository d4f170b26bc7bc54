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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from smajax.attribution.asked_ahead import ask_ahead
from smajax.attribution.explained_share import EXPLAINED, explained_share
from smajax.attribution.findings import ParameterFinding
from smajax.attribution.fit_programs import grouped, samples_of
from smajax.attribution.fitted_sets import JointSearch
from smajax.attribution.laplace_evidence import FittedModel, fitted_model, independent_error
from smajax.attribution.model_fits import Model, Search
from smajax.attribution.record_error import FoundRecordErrors, RecordError
from smajax.attribution.record_fits import (
    FITTING,
    LEAST_ODDS,
    MOST_LEFT,
    OF_RECORDS,
    Beside,
    Fit,
    Host,
    kind_of,
    likeliest,
    log_odds,
    needed,
    with_record_errors,
)
from smajax.core.names_of_runs import of_run
from smajax.core.parameters import parameters
from smajax.data.experiment.record import Experiment, Prior, Run, Unknown
from smajax.fit.base_model import base_model
from smajax.fit.outputs_of_runs import begin_derivatives
from smajax.model.extended import with_effects
from smajax.model.system import System, recorded_apart

FAR_LESS = 4.0  # times that what the present model leaves before a search has ended: what is missing may be what it has not come to yet
ON_TRIAL = (
    4.0  # times less than the base model that values of one run, or of two, leave of all runs, to be corrected on trial
)
AT_NOISE = 1.1  # noises: what leaves no more leaves noise
FITS = 12  # beside each host, as a rule: of two runs, each in every way in which its record may be wrong
LEAST_RUNS = 3  # of two runs that disagree either may be the wrong one


def record_errors(
    setting: Search,
    hosts: Sequence[Host],
    present: Host,
    runs: Sequence[Run],
    times_less: float | None = None,
    trials: bool = False,
) -> FoundRecordErrors | None:
    """The likeliest error of the record of one fit run, where it is likelier than `present` by `LEAST_ODDS`; `runs` of the fit, in order.

    It is sought beside each of `hosts`, in the place of all effects that `present` has beside theirs. `times_less`: by which the model with it leaves less at least; None: it may leave as much.
    `trials`: if there is none, one that leaves more than noise is given as well, on trial, where it takes most of what the base model leaves of all runs: what is left may be another one, and effects
    that are found beside it. If no single one does, two of different runs are sought.
    Without errors where none is needed beside effects that leave next to noise: the values of presets, which are free here, were what was missing.
    """
    if len(runs) < LEAST_RUNS:
        return None
    names = [run.name for run in runs]
    carried = _carried(setting, hosts)
    others = list(zip(hosts[1:], carried[1:], strict=True))
    asked = [ask_ahead(FITTING, setting, _singly, *one, names) for one in others]
    first = Beside.of(setting, hosts[0], carried[0], names)
    # After the first host the last one that the second process is not at.
    singly = [[] if first is None else first.singly(), *[one.result() for one in reversed(asked)][::-1]]
    fits = [fit for its_fits in singly for fit in its_fits]
    if not fits:
        return None
    here = fitted_model(setting.joint(setting.candidates), present.effects, present.values, present.effects)
    compared = _Compared(here, float(setting.problem.noise_sigma), setting.noise_given, times_less, fits)

    def found(tried: Sequence[Fit]) -> FoundRecordErrors | None:
        return _found(setting, compared, tried, present, runs) if tried else None

    explained = compared.explaining(fits)
    if explained:
        best = likeliest(explained, compared.error)
        beside = FoundRecordErrors((), best.host.effects)
        return found([best]) if needed(best, compared.error, len(runs)) else beside
    alone = [fit for fit in compared.on_trial(fits) if needed(fit, compared.error, len(runs))]
    if alone or not trials:
        return found(alone) if trials else None
    sought = [first, *(Beside.of(setting, *one, names) for one in others)]
    pairs = zip(sought, singly, strict=True)
    both = [fit for one, its_fits in pairs if one is not None for fit in one.in_two_runs(its_fits, compared.error)]
    compared = replace(compared, fits=(*fits, *both))
    both = [fit for fit in both if needed(fit, compared.error, len(runs))]
    return found(compared.explaining(both)) or found(compared.on_trial(both))


def _singly(setting: Search, host: Host, carried: Sequence[str], runs: Sequence[str]) -> list[Fit]:
    """`Beside.singly`, where a record can be wrong in any of the ways known."""
    sought = Beside.of(setting, host, carried, runs)
    return [] if sought is None else sought.singly()


def begin_record_errors(setting: Search, hosts: Sequence[Host], runs: Sequence[Run]) -> None:
    """Have a second process, where there is one, make the programs of `record_errors` with these arguments."""
    if len(runs) < LEAST_RUNS:
        return
    for host, more in zip(hosts, _carried(setting, hosts), strict=True):
        own, slots = setting.restricted((*host.effects, *more))
        begin_derivatives([with_record_errors(own, host.values[slots], [run.name for run in runs])[0]])


def _carried(setting: Search, hosts: Sequence[Host]) -> list[list[str]]:
    """Effects that the program of each host has beside its own: those of hosts with which sharing one takes less time."""
    sets = [tuple(host.effects) for host in hosts]
    groups = grouped(sets, (), FITS * samples_of(setting.problem))
    program_of = {effects: program for program, its_sets in groups for effects in its_sets}
    return [sorted(program_of[effects] - set(effects) - OF_RECORDS) for effects in sets]


@dataclass(frozen=True)
class _Compared:
    """What fits with errors of records are held against: the present model, the noise (SI), and each other. `times_less` as of `record_errors`."""

    present: FittedModel
    noise: float
    noise_given: bool
    times_less: float | None
    fits: Sequence[Fit]

    @cached_property
    def error(self) -> float:
        """Of an independent sample, SI, by the model that leaves least."""
        best = min([self.present, *(fit.model for fit in self.fits)], key=lambda model: model.rms)
        return independent_error(best, self.noise, self.noise_given)

    def ahead(self, fit: Fit) -> float:
        """In log odds of the present model."""
        return fit.model.log_evidence(self.error**2) - self.present.log_evidence(self.error**2)

    def explaining(self, fits: Sequence[Fit]) -> list[Fit]:
        """Those that leave next to noise, and are likelier than the present model."""
        return [fit for fit in fits if self._explains(fit.model.rms) and self.ahead(fit) >= LEAST_ODDS]

    def _explains(self, left: float) -> bool:
        """Whether so much (root mean square, SI) is next to noise, and most of what the present model leaves is gone."""
        if left > MOST_LEFT * self.noise:
            return False
        if self.times_less is not None:
            return left <= self.present.rms / self.times_less
        # A small error of any record takes a little of what all else is missing.
        return left <= AT_NOISE * self.noise or explained_share(left, self.present.rms, self.noise) >= EXPLAINED

    def _leaves_more(self, left: float) -> bool:
        """Whether so much (root mean square, SI) is more than noise, or at the end of a search too little less than the present model leaves."""
        return not self._explains(left) if self.times_less is None else left > MOST_LEFT * self.noise

    def on_trial(self, fits: Sequence[Fit]) -> list[Fit]:
        """Those that take most of what the base model leaves and leave more than noise, and are likelier than the present model."""
        beside_none = [fit for fit in fits if not fit.host.effects and self._leaves_more(fit.model.rms)]
        return [fit for fit in beside_none if fit.model.rms <= fit.before / ON_TRIAL and self.ahead(fit) >= LEAST_ODDS]


def _found(
    setting: Search, compared: _Compared, tried: Sequence[Fit], present: Host, runs: Sequence[Run]
) -> FoundRecordErrors:
    """The errors of the likeliest of the fits that were `tried`, as they are reported."""
    found = likeliest(tried, compared.error)
    errors = found.model.standard_errors(compared.error**2)
    instead = tuple(effect for effect in present.effects if effect not in found.host.effects)
    on_trial = not compared.explaining([found])
    records = []
    for event in found.events:
        run = next(one for one in runs if one.name == event.run)
        channel = _channel(setting.problem.system, event.coefficient, run)
        size = event.value, errors[event.name], compared.ahead(found)
        seconds = float(run.time[-1] - run.time[0])
        records.append(RecordError(run.name, channel, event.coefficient, *size, instead, seconds, on_trial))
    return FoundRecordErrors(tuple(records), found.host.effects)


def _channel(system: System, coefficient: str, run: Run) -> str:
    """The input of `run` that a coefficient says something of; "load" where none of its inputs is the load."""
    if coefficient.startswith("wrong_load"):
        return next((name for name in ("mass", "stress") if name in run.inputs), "load")
    return next(name for name in sorted(recorded_apart(system)) if name in run.inputs)


def corrected(experiment: Experiment, found: RecordError) -> Experiment:
    """The experiment with one run as it should have been recorded: the effect in the base model, off in all other runs.

    Its size in that run is an unknown that begins at what was found.
    """
    table = parameters(with_effects(base_model(experiment), [found.coefficient.split(".")[0]]))
    about = table[found.coefficient]
    low, high = min(about.low, found.value), max(about.high, found.value)
    prior = Prior(0.0, kind_of(found.coefficient).sigma, False)
    unknown = Unknown(found.coefficient, about.unit, low, high, found.value, True, prior, (found.run,))
    return replace(
        experiment,
        unknowns=(*experiment.unknowns, unknown),
        parameters={**experiment.parameters, found.coefficient: 0.0},
    )


def standing(errors: Sequence[RecordError], search: JointSearch, final: Model, runs: int) -> tuple[RecordError, ...]:
    """Those of the errors that the final model of a search needs, of so many `runs`: one that was found beside less may be none beside what was found later."""
    model = search.fitted[search.joint.ordered(final.effects)]
    sizes = model.standard_errors(search.error(model) ** 2)

    def stands(one: RecordError) -> bool:
        name = of_run(one.coefficient, one.run)
        value = float(final.values[search.joint.slots[name]])
        return log_odds(one.coefficient, value, sizes[name], runs) >= LEAST_ODDS

    return tuple(one for one in errors if stands(one))


def as_fitted(found: RecordError, after: Sequence[ParameterFinding]) -> RecordError:
    """The error as the final model has it, of which `after` are the parameters."""
    own = next((one for one in after if one.name == of_run(found.coefficient, found.run)), None)
    if own is None:
        return found
    error = found.standard_error if own.standard_error is None else own.standard_error
    return replace(found, value=own.value, standard_error=error)
