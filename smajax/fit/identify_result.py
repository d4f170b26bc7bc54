"""The result of an identification, as records that the report and programs read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smajax.core.old_words import worded
from smajax.data.experiment.record import Prior
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.fit.design import Suggestion
from smajax.fit.directions import Direction
from smajax.fit.identifiability import Checks
from smajax.fit.integration import IntegrationError
from smajax.fit.levenberg_marquardt import Status
from smajax.fit.posterior import Posterior
from smajax.fit.profile import Profile
from smajax.fit.uncertainty import Remark


@dataclass(frozen=True)
class Estimate:
    """One parameter, SI (temperatures in degrees Celsius); `parameter[run]` is the value of that run."""

    name: str
    unit: str
    value: float
    standard_error: float | None  # None: not identifiable
    lower: float
    upper: float
    start: float
    prior: Prior | None
    note: Remark

    @property
    def remark(self) -> str:
        """`note` in words; DeprecationWarning."""
        return str(worded("estimate.remark", "narrate(identified).remarks[name]", "remark_text", self.note))


@dataclass(frozen=True)
class FitEnd:
    """Why the best fit ended, and how many starts came to the same."""

    status: Status
    steps: int
    most_steps: int
    tolerance: float  # share of the cost, below which a fit has converged
    fits: int  # that were run until their end
    same_cost: int  # of these, with the least cost


@dataclass(frozen=True)
class IdentifiedOutput:
    """One sensor, SI (temperatures in degrees Celsius)."""

    name: str
    unit: str
    noise_sigma: float
    noise_how: str
    noise_before: float | None  # where it is estimated with the fit: as estimated before, from differences of samples
    ratio: float  # rms of the fit runs' residual over the noise of the fit

    @property
    def over_noise(self) -> float:
        """The same over the noise that neighbouring samples show, or that was given: a noise from the fit is the residual itself."""
        return self.ratio * self.fitted_over_shown

    @property
    def fitted_over_shown(self) -> float:
        """Noise of the fit over that of neighbouring samples; 1 where it was not fitted."""
        return self.noise_sigma / (self.noise_before or self.noise_sigma)


@dataclass(frozen=True)
class IdentifiedSeries:
    """One sensor in one run, (n,) each; nan where a sample is missing."""

    output: str
    measured: np.ndarray
    simulated: np.ndarray  # with the run's offset
    spread: np.ndarray  # standard error of the simulation, from those of the parameters
    rmse: float  # nan without a sample


@dataclass(frozen=True)
class IdentifiedRun:
    """One run as the fitted model simulates it."""

    name: str
    role: str
    time: np.ndarray  # (n,)
    inputs: dict[str, np.ndarray]
    series: tuple[IdentifiedSeries, ...]

    @property
    def rmse(self) -> float:
        """Of the first output."""
        return self.series[0].rmse


@dataclass(frozen=True)
class Identified:
    """Result of `identify`. `correlation` is that of the estimates `correlated`, (K, K)."""

    experiment: str
    title: str
    source: str
    outputs: tuple[IdentifiedOutput, ...]
    ended: FitEnd
    warnings: tuple[str, ...]  # of the experiment file
    checks: Checks  # at the initial guess
    estimates: tuple[Estimate, ...]
    values_of_held_out_runs: dict[str, float]  # values of single held-out runs, fitted with all others fixed
    correlated: tuple[str, ...]
    correlation: np.ndarray
    all_took_part: bool  # whether `directions` covers every parameter: none at a bound or without any effect
    directions: tuple[Direction, ...]  # weakest first
    profiles: tuple[Profile, ...]
    posterior: Posterior | None
    start_costs: tuple[float, ...]  # mean square over the noise's, of every fit that was run until its end
    ratio: float  # rms of the fit runs' residual over the noise of the fit
    whiteness_p: float
    normality_p: float
    independent: float  # samples an independent one
    robust: bool
    runs: tuple[IdentifiedRun, ...]
    suggestions: tuple[Suggestion, ...]
    integration: IntegrationError  # what the integration leaves in the outputs, of every run
    step: float  # s from sample to sample of every run; one where only the order of the samples is known
    clocked: bool  # whether the samples have times
    provenance: dict[str, str]
    held_presets: tuple[str, ...] = ()  # values that the file does not give, held at the presets'
    fitted_presets: tuple[str, ...] = ()  # values that the file does not give and that were fitted too
    model: ActuatorModel | None = None  # as it is saved

    @property
    def over_noise(self) -> float:
        """Rms of the fit runs' residual over the noise that neighbouring samples show, or that was given; of all outputs together."""
        if len(self.outputs) == 1:
            return self.ratio * self.outputs[0].fitted_over_shown
        fit = [run for run in self.runs if run.role == "fit"]
        counts = [sum(int(np.isfinite(run.series[k].measured).sum()) for run in fit) for k in range(len(self.outputs))]
        return float(np.sqrt(np.average([one.over_noise**2 for one in self.outputs], weights=counts)))

    @property
    def stopped(self) -> str:
        """`ended` in words; DeprecationWarning."""
        return str(worded("identified.stopped", "narrate(identified).ended", "ended_sentence", self.ended))

    @property
    def check(self) -> tuple[str, ...]:
        """`warnings` and `checks` in words; DeprecationWarning."""
        now = "narrate(identified).check"
        return tuple(worded("identified.check", now, "check_sentences", self.warnings, self.checks))

    @property
    def weak(self) -> tuple[str, ...]:
        """The weak ones of `directions` in words; DeprecationWarning."""
        return tuple(worded("identified.weak", "narrate(identified).weak", "weak_combinations", self.directions))
