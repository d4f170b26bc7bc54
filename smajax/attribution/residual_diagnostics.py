"""Whether a residual is noise, by its size and its autocorrelation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from smajax.attribution.config import AttributionConfig
from smajax.core.whiteness import WHITE, correlation_time, first_order, whiteness_p_value
from smajax.fit.residual_diagnostics import ResidualDiagnostics
from smajax.fit.residual_diagnostics import diagnosed as of_residuals

DEFAULT = AttributionConfig()


def diagnosed(
    residuals: Sequence[np.ndarray],
    states: Sequence[Mapping[str, np.ndarray]],
    noise_sigma: float,
    noise_given: bool = True,
    config: AttributionConfig = DEFAULT,
) -> ResidualDiagnostics:
    """As `smajax.fit.residual_diagnostics.diagnosed`; `noise_given`: and not estimated, so that no first-order noise is looked for."""
    coefficient = 0.0 if noise_given else _filter_coefficient(residuals, noise_sigma, config)
    return replace(of_residuals(residuals, states, noise_sigma), filter_coefficient=coefficient)


def noise_like(found: ResidualDiagnostics, config: AttributionConfig = DEFAULT) -> bool:
    """Nothing left to explain: white, or no larger than the noise but for what its autocorrelation accounts for; of every output."""
    if found.noise_by_output:
        return all(found.noise_by_output.values())
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


def noise_by_output(
    residuals: Sequence[Sequence[np.ndarray]], noise_sigma: float, given: Sequence[bool], config: AttributionConfig
) -> list[bool]:
    """`all_noise` of the residuals of each output, in noises of the first, by itself: what one leaves is not made up for by another."""
    return [not own or all_noise(own, noise_sigma, known, config) for own, known in zip(residuals, given, strict=True)]


def all_noise(
    residuals: Sequence[np.ndarray], noise_sigma: float, noise_given: bool = True, config: AttributionConfig = DEFAULT
) -> bool:
    """`noise_like` of residuals (SI, one array of shape (n,) a run), without the rest of their diagnostics."""
    everything = np.concatenate(residuals)
    ratio = float(np.sqrt(np.mean(everything**2))) / noise_sigma
    independent = len(everything) / correlation_time(residuals)
    plain = _is_noise(ratio, whiteness_p_value(residuals) > WHITE, independent, config)
    return plain or (not noise_given and _filter_coefficient(residuals, noise_sigma, config) > 0.0)
