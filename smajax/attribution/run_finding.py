"""One measured run beside the base and the extended model, output by output: numbers, of numpy, SI."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Role = Literal["fit", "held-out"]


@dataclass(frozen=True)
class AveragedRun:
    """One run by the average of the likely models, arrays of shape (n,), SI."""

    reading: np.ndarray
    half_width: np.ndarray  # of the band about it in which nine of ten measured samples are expected
    rmse: float
    coverage: float  # share of the measured samples inside the band
    samples: int  # measured ones
    moving_coverage: float = math.nan  # share of those at which the output moves (`fit.prediction_band.moving`)
    moving_samples: int = 0


@dataclass(frozen=True, kw_only=True)
class BesideModels:
    """One measured output of a run beside the two models; every array has shape (n,) on the run's clock, SI."""

    measured: np.ndarray  # nan where a sample is missing
    before: np.ndarray  # base model, the run's own offset included
    after: np.ndarray  # extended model; equal to `before` when nothing was added
    offset_before: float
    offset_after: float
    rmse_before: float
    rmse_after: float
    average: AveragedRun | None = None

    @property
    def samples(self) -> int:
        """Measured ones."""
        return int(np.isfinite(self.measured).sum())


@dataclass(frozen=True, kw_only=True)
class OutputFinding(BesideModels):
    """Another output of a run than the first."""

    name: str
    unit: str  # SI
    noise_sigma: float
    noise_how: str
    scale: float  # noise of the first output over its own


@dataclass(frozen=True, kw_only=True)
class RunFinding(BesideModels):
    """One measured run: its first output, and the others as `others`."""

    name: str
    role: Role
    time: np.ndarray  # s
    inputs: dict[str, np.ndarray]  # SI, by channel name
    states: dict[str, np.ndarray]  # of the model after: temperature (C), martensite_fraction (-), stress (Pa)
    others: tuple[OutputFinding, ...] = ()  # the other outputs, where there are several
    # Parameter -> its value of this run's own, of a held-out run, which was fitted to it alone by each of the models; those of fit runs are
    # parameters of the fit.
    own_before: dict[str, float] = field(default_factory=dict)
    own_after: dict[str, float] = field(default_factory=dict)

    def residuals(self, which: Literal["before", "after"]) -> list[np.ndarray]:
        """What a model leaves of the measured samples of every output, those of others in noises times the first one's."""
        every = [(1.0, self.measured, getattr(self, which))]
        every += [(one.scale, one.measured, getattr(one, which)) for one in self.others]
        found = [scale * (measured - model)[np.isfinite(measured)] for scale, measured, model in every]
        return [one for one in found if one.size]


def pooled(parts: Iterable[tuple[float, int]]) -> float:
    """Root mean square of parts of (root mean square, samples) each; NaN without any."""
    kept = [(rms, samples) for rms, samples in parts if samples]
    return (
        float(np.sqrt(sum(rms**2 * samples for rms, samples in kept) / sum(n for _, n in kept))) if kept else math.nan
    )
