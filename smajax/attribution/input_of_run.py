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
from dataclasses import replace

from smajax.attribution.findings import ParameterFinding
from smajax.attribution.laplace_evidence import fitted_model, independent_error
from smajax.attribution.model_fits import Search
from smajax.attribution.record_error import FoundRecordErrors, RecordError
from smajax.attribution.record_fits import KINDS, MOST_LEFT, Beside, Fit, Host, likeliest, needed
from smajax.core.names_of_runs import of_run
from smajax.core.parameters import parameters
from smajax.data.experiment.record import Experiment, Prior, Run, Unknown
from smajax.fit.base_model import base_model
from smajax.model.extended import with_effects
from smajax.model.system import System, recorded_apart

LEAST_ODDS = 3.0  # in log odds: twenty to one that the record is wrong, before a run is corrected by it
FAR_LESS = 4.0  # times that what the present model leaves before a search has ended: what is missing may be what it has not come to yet
ON_TRIAL = (
    4.0  # times less than the base model that values of one run, or of two, leave of all runs, to be corrected on trial
)
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
    sought = [one for host in hosts if (one := Beside.of(setting, host, names)) is not None]
    singly = [one.singly() for one in sought]
    if not singly:
        return None
    fits = [fit for its_fits in singly for fit in its_fits]
    here = fitted_model(setting.joint(setting.candidates), present.effects, present.values, present.effects)
    noise = float(setting.problem.noise_sigma)
    best = min([here, *(fit.model for fit in fits)], key=lambda model: model.rms)
    error = independent_error(best, noise, setting.noise_given)

    def ahead(fit: Fit) -> float:
        return fit.model.log_evidence(error**2) - here.log_evidence(error**2)

    def explains(fit: Fit) -> bool:
        """Whether next to noise is left, and the model is likelier than the present one."""
        near = times_less is not None and fit.model.rms > here.rms / times_less
        return ahead(fit) >= LEAST_ODDS and fit.model.rms <= MOST_LEFT * noise and not near

    def on_trial(fit: Fit) -> bool:
        return ahead(fit) >= LEAST_ODDS and not fit.host.effects and fit.model.rms <= fit.before / ON_TRIAL

    def found(tried: Sequence[Fit]) -> FoundRecordErrors | None:
        if not tried:
            return None
        fit = likeliest(tried, error)
        return _found(setting, fit, present, runs, ahead(fit), error, not explains(fit))

    wrong = [fit for fit in fits if needed(fit, error, LEAST_ODDS)]
    explained = [fit for fit in fits if explains(fit)]
    if explained:
        first = likeliest(explained, error)
        return found([first]) if first in wrong else FoundRecordErrors((), first.host.effects)
    alone = [fit for fit in wrong if on_trial(fit)]
    if alone or not trials:
        return found(alone) if trials else None
    both = [fit for k, one in enumerate(sought) for fit in one.in_two_runs(singly[k], error)]
    both = [fit for fit in both if needed(fit, error, LEAST_ODDS)]
    return found([fit for fit in both if explains(fit)]) or found([fit for fit in both if on_trial(fit)])


def _found(
    setting: Search, found: Fit, present: Host, runs: Sequence[Run], ahead: float, error: float, on_trial: bool = False
) -> FoundRecordErrors:
    """The errors of a fit, as they are reported; `ahead` in log odds of `present`, `error` of an independent sample, SI."""
    errors = found.model.standard_errors(error**2)
    instead = tuple(effect for effect in present.effects if effect not in found.host.effects)
    records = []
    for event in found.events:
        run = next(one for one in runs if one.name == event.run)
        channel = _channel(setting.problem.system, event.coefficient, run)
        seconds = float(run.time[-1] - run.time[0])
        records.append(
            RecordError(
                run.name, channel, event.coefficient, event.value, errors[event.name], ahead, instead, seconds, on_trial
            )
        )
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
