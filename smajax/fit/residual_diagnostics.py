"""Residual diagnostics: its size against the noise, its autocorrelation, and in which phases of a run it is large."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from smajax.core.whiteness import WHITE, correlation_time, whiteness_p_value


@dataclass(frozen=True)
class ResidualDiagnostics:
    """Of the residual (measured minus model) of the fit runs."""

    rmse: float
    noise_sigma: float
    ratio: float  # rmse / noise_sigma
    white: bool
    whiteness_p_value: float
    independent: float  # samples over the correlation time
    by_phase: dict[str, dict[str, float]]  # "heating, transforming" -> {samples, share_of_squared_error, mean, rmse}
    correlation: dict[str, float]  # with time, input, temperature, martensite_fraction, stress, rate
    # Of a first-order autoregressive noise, where the residual is taken as one that is larger than estimated; else 0.
    filter_coefficient: float = 0.0
    # Of several outputs: whether what is left of each by itself is noise, by name.
    noise_by_output: dict[str, bool] = field(default_factory=dict)


def phase_of(fraction: np.ndarray, temperature: np.ndarray, ambient: float) -> np.ndarray:
    """One word per sample for what the wire is doing, from the model's own states; shape (n,)."""
    rate = np.gradient(fraction)
    moving = np.abs(rate) > 1e-4
    warming = np.gradient(temperature) > 0.0
    hot = temperature - ambient > 0.25 * max(float(np.max(temperature) - ambient), 1e-9)
    resting = np.where(hot, np.where(warming, "hot, warming", "hot, cooling"), "cold")
    return np.where(moving, np.where(rate < 0.0, "heating, transforming", "cooling, transforming"), resting)


def diagnosed(
    residuals: Sequence[np.ndarray],
    states: Sequence[Mapping[str, np.ndarray]],
    noise_sigma: float,
) -> ResidualDiagnostics:
    """Of the fit runs' residuals (SI, one array of shape (n,) a run).

    `states` gives, run by run, series of the model to hold the residual against; `temperature` and
    `martensite_fraction` are needed, others (inputs, stress, rates) are correlated as well.
    """
    everything = np.concatenate(residuals)
    rmse = float(np.sqrt(np.mean(everything**2)))
    p_value = whiteness_p_value(residuals)
    ambient = min(float(np.min(state["temperature"])) for state in states)
    phases = np.concatenate([phase_of(state["martensite_fraction"], state["temperature"], ambient) for state in states])
    total = float(everything @ everything)
    by_phase = {}
    for phase in sorted(set(phases.tolist())):
        here = everything[phases == phase]
        by_phase[str(phase)] = {
            "samples": float(len(here)),
            "share_of_squared_error": float(here @ here) / total if total else 0.0,
            "mean": float(here.mean()),
            "rmse": float(np.sqrt(np.mean(here**2))),
        }
    correlation = {}
    for name in states[0]:
        series = np.concatenate([np.asarray(state[name], float) for state in states])
        spread = series.std() * everything.std()
        correlation[name] = (
            float(np.mean((series - series.mean()) * (everything - everything.mean())) / spread) if spread else 0.0
        )
    ratio = rmse / noise_sigma
    white = p_value > WHITE
    return ResidualDiagnostics(
        rmse=rmse,
        noise_sigma=noise_sigma,
        ratio=ratio,
        white=white,
        whiteness_p_value=p_value,
        independent=len(everything) / correlation_time(residuals),
        by_phase=by_phase,
        correlation=correlation,
    )
