"""Residual diagnostics: its size against the noise, its autocorrelation, and in which phases of a run it is large."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.attribution.findings import ResidualDiagnostics
from smajax.core.whiteness import WHITE, correlation_time, first_order, whiteness_p_value

DEFAULT = AttributionConfig()


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
    noise_given: bool = True,
    config: AttributionConfig = DEFAULT,
) -> ResidualDiagnostics:
    """Of the fit runs' residuals (SI, one array of shape (n,) a run). `noise_given`: and not estimated.

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
        filter_coefficient=0.0 if noise_given else _filter_coefficient(residuals, noise_sigma, config),
    )


def noise_like(found: ResidualDiagnostics, config: AttributionConfig = DEFAULT) -> bool:
    """Nothing left to explain: white, or no larger than the noise but for what its autocorrelation accounts for."""
    return found.filter_coefficient > 0.0 or _is_noise(found.ratio, found.white, found.independent, config)


def _is_noise(ratio: float, white: bool, independent: float, config: AttributionConfig) -> bool:
    excess = 1.0 - (1.0 / max(ratio, 1e-9)) ** 2
    chance = config.noise_excess_errors * float(np.sqrt(2.0 / max(independent, 1.0)))
    allowed = min(max(config.noise_excess, chance), config.most_noise_excess)
    return excess <= allowed or (white and ratio < config.white_noise_ratio)


def _filter_coefficient(residuals: Sequence[np.ndarray], noise_sigma: float, config: AttributionConfig) -> float:
    """Coefficient of the first-order autoregressive noise that the residual is; 0 where it is none."""
    found = first_order(residuals)
    independent = sum(len(run) for run in residuals) / correlation_time(residuals)
    enough = independent > config.least_independent and found.p_value > WHITE
    small = found.sigma < config.most_filter_noise * noise_sigma
    return found.coefficient if enough and 0.0 < found.coefficient < config.most_filter_coefficient and small else 0.0


def all_noise(
    residuals: Sequence[np.ndarray], noise_sigma: float, noise_given: bool = True, config: AttributionConfig = DEFAULT
) -> bool:
    """`noise_like` of residuals (SI, one array of shape (n,) a run), without the rest of their diagnostics."""
    everything = np.concatenate(residuals)
    ratio = float(np.sqrt(np.mean(everything**2))) / noise_sigma
    independent = len(everything) / correlation_time(residuals)
    plain = _is_noise(ratio, whiteness_p_value(residuals) > WHITE, independent, config)
    return plain or (not noise_given and _filter_coefficient(residuals, noise_sigma, config) > 0.0)
