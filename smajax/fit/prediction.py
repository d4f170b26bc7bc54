"""A prediction as records: runs with their bands, and the errors over all of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.fit.integration import IntegrationError
from smajax.fit.residual_diagnostics import ResidualDiagnostics, diagnosed


@dataclass(frozen=True)
class PredictedSeries:
    """One sensor in one run, arrays of shape (n,), SI; nan in `measured` where a sample is missing."""

    output: str
    unit: str
    measured: np.ndarray
    reading: np.ndarray  # of the average of the likely models, with the run's offset
    half_width: np.ndarray  # of the band
    noise: float  # sigma of a sample
    offset: float  # of the run, that was added to the reading: the average of the likely models'
    rmse: float
    coverage: float  # share of the measured samples inside the band
    moving: np.ndarray  # bool, at which samples the output moves (`prediction_band.moving`)
    moving_coverage: float  # share of these inside the band; nan where it never moves


@dataclass(frozen=True)
class Extrapolation:
    """A quantity that leaves the range of the runs that the model was fitted to, SI."""

    quantity: str
    unit: str
    fitted: tuple[float, float]  # lowest and highest
    reached: tuple[float, float]
    share: float  # of the samples
    spans: tuple[tuple[float, float], ...]  # s, of the run's clock: from, to


@dataclass(frozen=True)
class PredictedRun:
    """One run as the model predicts it."""

    name: str
    time: np.ndarray  # (n,), s
    inputs: dict[str, np.ndarray]
    series: tuple[PredictedSeries, ...]
    states: dict[str, np.ndarray]  # of the likeliest model: temperature (degC), martensite_fraction (-), stress (Pa)
    extrapolation: tuple[Extrapolation, ...]
    sha256: str
    fitted: bool  # whether the model was fitted to this run


@dataclass(frozen=True)
class OutputErrors:
    """Of one output over all samples of all runs, SI; nan where nothing was measured."""

    rmse: float
    coverage: float  # share of the measured samples inside the band
    moving_coverage: float  # of those at which the output moves
    residual: ResidualDiagnostics | None  # None where nothing was measured


@dataclass(frozen=True)
class Prediction:
    """A model's prediction of some runs. step: s, from sample to sample."""

    model: ActuatorModel
    runs: tuple[PredictedRun, ...]
    step: float
    integration: IntegrationError
    warnings: tuple[str, ...] = ()

    def measured_runs(self, output: int = 0) -> list[PredictedRun]:
        """Those with a sample of that output."""
        return [run for run in self.runs if np.isfinite(run.series[output].rmse)]

    @cached_property
    def errors(self) -> tuple[OutputErrors, ...]:
        """Of each output, in the order of a run's series."""
        return tuple(self._errors_of(output) for output in range(len(self.runs[0].series)))

    def _errors_of(self, output: int) -> OutputErrors:
        series = [run.series[output] for run in self.runs]
        error = np.concatenate([one.measured - one.reading for one in series])
        width = np.concatenate([one.half_width for one in series])
        present, moves = np.isfinite(error), np.concatenate([one.moving for one in series])
        if not present.any():
            return OutputErrors(float("nan"), float("nan"), float("nan"), None)
        return OutputErrors(
            rmse=float(np.sqrt(np.mean(error[present] ** 2))),
            coverage=float(np.mean(np.abs(error) <= width, where=present)),
            moving_coverage=float(np.mean(np.abs(error[moves]) <= width[moves])) if moves.any() else float("nan"),
            residual=self._diagnostics(output),
        )

    def _diagnostics(self, output: int) -> ResidualDiagnostics | None:
        runs = self.measured_runs(output)
        if not runs:
            return None
        residuals, states = [], []
        for run in runs:
            one = run.series[output]
            present = np.isfinite(one.measured)
            held = {"time": run.time - run.time[0], **run.states}
            held["temperature_rate"] = np.gradient(run.states["temperature"])
            held |= {name: values for name, values in run.inputs.items() if name not in held}
            residuals.append((one.measured - one.reading)[present])
            states.append({name: np.asarray(values)[present] for name, values in held.items()})
        return diagnosed(residuals, states, runs[0].series[output].noise)
