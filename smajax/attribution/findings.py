"""What `close-loop` found: numbers and enums, which `smajax.report.narrative` puts into words.

Arrays are numpy, SI, temperatures in degrees Celsius, angles in radians; nothing in here simulates or fits.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from typing import Any, Literal

import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.attribution.prior_finding import PriorFinding
from smajax.attribution.reasons import HeldOutWorse, Reason, StepDependent
from smajax.attribution.record_error import OutlierRun, RecordError
from smajax.attribution.run_finding import AveragedRun as AveragedRun
from smajax.attribution.run_finding import OutputFinding as OutputFinding
from smajax.attribution.run_finding import Role as Role
from smajax.attribution.run_finding import RunFinding as RunFinding
from smajax.attribution.run_finding import pooled as pooled
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.fit.identifiability import Checks
from smajax.fit.integration import IntegrationError
from smajax.fit.residual_diagnostics import ResidualDiagnostics as ResidualDiagnostics
from smajax.fit.uncertainty import Remark
from smajax.model.effects.library import LIBRARY


class Verdict(StrEnum):
    """By whether something was added, and whether what is left of the fit runs is noise."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly explained"
    NOT_IN_LIBRARY = "not in the library"
    NOT_FINISHED = "not finished"  # of an attribution that goes on, or was ended before its end


class Remaining(StrEnum):
    """What an attribution that goes on has still to do."""

    NOTHING = ""
    SEARCH = "the search for effects, and the checks of what it finds"
    REST_OF_THE_SEARCH = "the rest of the search, and the checks of what it finds"
    CHECKS = "the checks against an unknown function, an outlier run and the held-out runs"


@dataclass(frozen=True)
class AveragedModel:
    """A model that predictions are averaged over."""

    effects: tuple[str, ...]
    weight: float  # posterior probability, 0..1; those of all of them sum to one


@dataclass(frozen=True)
class ParameterFinding:
    """One fitted number. `standard_error` is None when the runs do not determine it (then `remark` says why)."""

    name: str
    unit: str
    value: float
    standard_error: float | None
    lower: float
    upper: float
    start: float
    remark: Remark = field(default_factory=Remark)
    prior_base: float | None = None  # middle of its prior; None of what has none
    prior_deviation: float | None = None  # widths of that prior from its middle, with a sign
    prior_of_unknown: bool = False  # given with the unknown in the file; else of a preset's value

    @property
    def limited(self) -> bool:
        """Whether it ends at a bound that it might lie beyond: a share of all or of nothing is not."""
        return self.remark.at_bound and (self.unit, self.lower, self.upper) != ("-", 0.0, 1.0)

    @property
    def at_zero(self) -> bool:
        """Whether it ends at the end of its range that is zero: an effect with such a coefficient is off."""
        return self.limited and self.lower == 0.0 and self.value < 0.5 * self.upper


@dataclass(frozen=True)
class AssumedParameter:
    """A parameter of the base model that no fit and no log gives."""

    name: str
    unit: str
    value: float  # SI
    size_not_given: bool  # a size of the wire or a number of the load that is the preset's in every run


@dataclass(frozen=True)
class CoefficientFinding:
    value: float
    standard_error: float | None
    unit: str
    by_runs: tuple[float, float] | None = None  # 95 % by the jackknife over runs
    widths_off: float | None = None  # from the base value, in widths of the effect's prior; with a sign


@dataclass(frozen=True)
class EffectFinding:
    """One candidate of the library. `evidence` holds numbers only; NaN where a stage was not reached."""

    name: str  # "latent_heat"
    title: str  # "latent heat of transformation"
    equation: str  # the equation it changes: heat, electrical, kinetics, constitutive, mechanics, sensor, input
    formula: str  # the change itself, plain text, with its source
    added: bool
    coefficients: dict[str, CoefficientFinding]
    evidence: dict[str, float]  # posterior_probability, alone_rmse_fit, score_p_value_at_the_end, ...

    @property
    def probability(self) -> float:
        """Posterior probability; NaN where it was in no fitted set."""
        return self.evidence.get("posterior_probability", float("nan"))


@dataclass(frozen=True)
class DroppedModel:
    """A likely model that predictions are not averaged with, because it failed a check that the final model has passed."""

    effects: tuple[str, ...]
    weight: float  # posterior probability among the likely models before
    reason: StepDependent | HeldOutWorse


@dataclass(frozen=True)
class Round:
    """One round of the search, or what a later stage took out of the model that it ended with."""

    number: int
    tried: tuple[tuple[str, float], ...]  # what a later stage compared: ("latent_heat + radiation", leave-one-out rmse)
    chosen: str  # the likeliest set, or what was taken out; "" where nothing changed
    reason: Reason
    removed: bool = False  # `chosen` was taken out


@dataclass(frozen=True)
class Confounder:
    """A candidate that could be mistaken for an effect that was added."""

    effect: str
    confounder: str
    overlap: float  # share of the effect's trace in these runs that the confounder could have left, 0..1
    weight: (
        float  # posterior probability of the model that has it instead, among the model and all its confounders, 0..1
    )
    rmse_fit: float  # of the model that has it instead, on the fit runs, SI
    separating_run: str  # the run on which the two fitted models differ most; "" where none was looked for
    separation: float  # by how many times the noise, rms
    # Of the model that has it instead over the one that was found, by the runs alone: without priors and prior odds.
    log_likelihood_ratio: float = float("nan")
    only_by_priors: bool = False  # the runs alone hardly tell the two, or prefer it
    more_parameters: int = 0  # that the model has which has it instead


@dataclass(frozen=True)
class Rejected:
    """Effects that the held-out runs did not validate, and the error there; SI."""

    effects: tuple[str, ...]
    rmse_without: float
    rmse_with: float
    may_be_chance: bool = False  # the difference; by more than `held_out_worse`, of a model that leaves more than noise


@dataclass(frozen=True)
class Formula:
    """A simple formula for a function that was learnt, SI; `curve`: its values along the function's range."""

    text: str  # "0.12 + 3.1e-05 T^2"
    chi_square: float  # against the learnt function
    numbers: int  # that it has
    bic: float
    curve: np.ndarray


@dataclass(frozen=True)
class UnknownTerm:
    """A smooth function of one state, put into one equation for what no effect of the library accounts for; SI."""

    name: str  # "unknown_loss_of_temperature"
    title: str  # "a heat loss depending on the temperature over the air's"
    equation: str
    symbol: str  # of the state
    state: str  # in words
    state_unit: str
    unit: str  # of the function
    named: bool  # the likeliest, likelier than none, which predicts runs left out and held out better than the model without it
    indistinguishable: tuple[str, ...]  # terms that the runs do not distinguish from the named one
    log_odds: float  # of the model with it over the one without
    score_gain: float
    left_out_before: float  # NaN where no term is likelier than none
    left_out_after: float | None  # None of a term that is less likely than none, or than others by far
    held_out_before: float | None  # on the held-out runs, where the term was asked for that
    held_out_after: float | None
    at: np.ndarray  # states, (points,)
    values: np.ndarray  # the function there
    error: np.ndarray  # its standard error there
    error_held: np.ndarray  # the same with the model's parameters held at their values
    cells: np.ndarray  # edges of cells of the range, (cells + 1,)
    samples: np.ndarray  # samples of the fit runs in each cell
    formulas: tuple[Formula, ...]


# The names of before, until version 0.3; sentences are in `smajax.report.narrative` now.
_RENAMED = {
    "portrait_before": "residual_before",
    "portrait_after": "residual_after",
    "rivals": "confounders",
    "lone_runs": "outlier_runs",
}
_NARRATED = ("summary", "unexplained", "cannot_know", "check")


@dataclass(frozen=True)
class Findings:
    experiment: str  # short name
    title: str
    source: str  # path of the experiment file as given
    verdict: Verdict
    warnings: tuple[str, ...]  # of the experiment file
    checks: Checks  # at the base model's fit
    output_name: str
    output_unit: str  # SI
    noise_sigma: float
    noise_how: str  # "given" or "estimated ..."
    runs: tuple[RunFinding, ...]
    before: tuple[ParameterFinding, ...]
    after: tuple[ParameterFinding, ...]
    effects: tuple[EffectFinding, ...]
    residual_before: ResidualDiagnostics
    residual_after: ResidualDiagnostics
    rounds: tuple[Round, ...]
    explained_variance: float  # share of the motion in left-out runs that the final model predicts
    step: float  # s, of the log's clock
    integration: IntegrationError  # of the final model on the fit runs
    offset: bool  # whether each run has its own zero
    wire: str  # presets
    load: str
    declared: tuple[str, ...] = ()  # parameters that the experiment file gives
    assumed: tuple[AssumedParameter, ...] = ()
    priors: tuple[PriorFinding, ...] = ()  # that the experiment file gives
    preset_expansion: tuple[float, float] | None = (
        None  # 1/K, martensite and austenite, that the preset's theta_T alone gives
    )
    averaged: tuple[AveragedModel, ...] = ()  # the likely models, over which `average` of each run is taken
    dropped: tuple[DroppedModel, ...] = ()  # likely models that are not among them
    correlated: tuple[tuple[str, ...], ...] = ()  # clusters of parameters whose estimates are correlated
    confounders: tuple[Confounder, ...] = ()
    superseded: tuple[str, ...] = ()  # effects that one unknown term supersedes
    rejected: tuple[Rejected, ...] = ()  # by the held-out runs, one for each search
    unknown: tuple[UnknownTerm, ...] = ()  # terms sought for what the library does not hold, best first
    outlier_runs: tuple[OutlierRun, ...] = ()
    record_errors: tuple[RecordError, ...] = ()  # inputs of single runs, which were corrected
    config: AttributionConfig = field(default_factory=AttributionConfig)
    provenance: dict[str, str] = field(default_factory=dict)  # versions, seed, data hashes, command, seconds
    base_model: ActuatorModel | None = None  # as they are saved
    extended_model: ActuatorModel | None = None
    effects_excluded: int = 0  # effects that this model can show and the experiment file keeps from being candidates
    remaining: Remaining = Remaining.NOTHING  # of what is known while the attribution goes on

    @property
    def integration_error(self) -> float:
        """What the integration leaves in the first output of the final model, SI: root mean square of the worst fit run."""
        rms = self.integration.rms
        return rms.get(self.output_name, next(iter(rms.values())))

    @property
    def added(self) -> tuple[EffectFinding, ...]:
        """The effects of the final model."""
        return tuple(effect for effect in self.effects if effect.added)

    @property
    def coefficients_at_bounds(self) -> tuple[ParameterFinding, ...]:
        """Sizes of added effects that end at a bound of their range, but for those at a zero where the effect is off.

        A time or a width of an effect at its bound says less: that these runs do not determine it.
        """
        sizes = {f"{effect.name}.{name}" for effect in self.added for name in LIBRARY[effect.name].candidate.switches}
        return tuple(one for one in self.after if one.limited and one.name in sizes and not one.at_zero)

    @property
    def fit_runs(self) -> int:
        return sum(run.role == "fit" for run in self.runs)

    def __getattr__(self, name: str) -> Any:
        """The names of before, with a DeprecationWarning."""
        if name in _RENAMED:
            return _warned(name, f"findings.{_RENAMED[name]}", getattr(self, _RENAMED[name]))
        if name in _NARRATED:
            # By the package's public name: nothing here depends on the report, but for users of the old names.
            narrated = import_module("smajax").narrate(self)
            return _warned(name, f"smajax.report.narrate(findings).{name}", getattr(narrated, name))
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


def _warned(old: str, now: str, value: Any) -> Any:
    warnings.warn(f"findings.{old} is {now} now; it goes in version 0.3", DeprecationWarning, stacklevel=3)
    return value


def pooled_rmse(runs: Sequence[RunFinding], role: Role, which: Literal["before", "after"]) -> float:
    """Root mean square error over all samples of the runs with `role`, SI; NaN when there are none."""
    return pooled((getattr(run, f"rmse_{which}"), run.samples) for run in runs if run.role == role)


def other_outputs(findings: Findings) -> list[OutputFinding]:
    """The outputs beside the first, as any run has them."""
    return list(findings.runs[0].others) if findings.runs else []


def pooled_rmse_of(runs: Sequence[RunFinding], output: str, role: Role, which: Literal["before", "after"]) -> float:
    """`pooled_rmse` of an output beside the first."""
    found = [one for run in runs if run.role == role for one in run.others if one.name == output]
    return pooled((getattr(one, f"rmse_{which}"), one.samples) for one in found)


def coverage(findings: Findings) -> float | None:
    """Share of the held-out samples inside the band of the averaged prediction; None without any."""
    return _weighed((one.coverage, one.samples) for one in _held_out_averages(findings))


def moving_coverage(findings: Findings) -> float | None:
    """The same of those at which the output moves (`fit.prediction_band.moving`)."""
    return _weighed((one.moving_coverage, one.moving_samples) for one in _held_out_averages(findings))


def _held_out_averages(findings: Findings) -> list[AveragedRun]:
    return [run.average for run in findings.runs if run.role == "held-out" and run.average is not None]


def _weighed(parts: Iterable[tuple[float, int]]) -> float | None:
    """Mean of (share, samples); None without any."""
    kept = [(share, samples) for share, samples in parts if samples]
    return sum(share * samples for share, samples in kept) / sum(n for _, n in kept) if kept else None
