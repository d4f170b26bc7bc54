r"""Evidence of a fitted model by Laplace's approximation.

$$\ln p(y|S) \approx -\frac{|r|^2}{2 s^2} - \tfrac12 \sum x_i^2 - \tfrac12 \ln\det(J^T J/s^2 + \Lambda) + \tfrac12\ln\det\Lambda,$$

with standardised coefficients $x$ (widths of their priors) at the fit (MacKay 1992). A coefficient that cannot fall
below its base has half a normal distribution before, and what of the posterior lies above the base after.

The widths of an effect's k coefficients are those of its file times one factor, found by evidence: $\tau = 1$, or
$\tau^2 = \sum x_i^2 / k$ where that is larger, with a prior of $\tau^{-2}$ (MacKay 1992, Tipping 2001). An effect that is far larger
than usual is unlikely, by a few nats, but no other effects are likelier for taking a part of it over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.attribution.joint_parameters import JointParameters, residual_and_columns
from smajax.core.whiteness import correlation_time, on_samples, split_runs

ROUNDING = 1e-14  # of an eigenvalue of a matrix whose diagonal is one
LONGEST = 50.0  # samples: beyond it the correlation of a residual is its own shape, and no property of a noise
NOISE_EXCESS = 1.05  # a residual up to so many noises is noise: its size is the noise's
LEAST_NOISE = 0.3  # of a noise that was estimated: what the residual shows counts down to that


@dataclass(frozen=True)
class FittedModel:
    """One set of effects with its best values, and what its evidence takes."""

    effects: tuple[str, ...]
    values: np.ndarray  # (P,)
    names: tuple[str, ...]  # of the free parameters
    scales: np.ndarray  # widths of their priors at the fit, SI
    squares: float  # sum of squared residuals, SI
    gram: np.ndarray  # of the standardised columns, SI squared
    precision: np.ndarray
    width_factors: dict[str, float]  # by how much each effect's prior is wider than its file says
    log_prior: float  # of the coefficients' values and of the effects' odds
    one_sided: tuple[tuple[int, float], ...]  # (place among `names`, widths from the base)
    residual: np.ndarray  # (n,) on the measured samples, SI
    rms: float  # of it, SI
    correlation: float  # samples to an independent one

    def log_evidence(self, variance: float) -> float:
        """Log evidence plus log prior odds; `variance` of an independent sample, SI squared, the same for all models compared."""
        eigenvalues, vectors, size = self._decomposed(variance)
        value = self.log_prior - 0.5 * self.squares / variance
        value += 0.5 * float(np.log(self.precision).sum() - np.log(eigenvalues).sum()) + float(np.log(size).sum())
        if self.one_sided:
            deviation = size * np.sqrt((vectors**2 / eigenvalues).sum(axis=1))
            value += sum(float(np.log(2.0) + scipy.stats.norm.logcdf(at / deviation[k])) for k, at in self.one_sided)
        return value

    def cost_of_coefficients(self, variance: float) -> float:
        """What the log evidence lacks beside the residual's part: priors, odds and widths against errors."""
        return -self.log_evidence(variance) - 0.5 * self.squares / variance

    def covariance(self, variance: float) -> np.ndarray:
        """Posterior covariance of the free parameters, in widths of their priors."""
        values, vectors, size = self._decomposed(variance)
        return np.asarray((vectors / values) @ vectors.T * np.outer(size, size))

    def _decomposed(self, variance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return decomposed(self.gram / variance + np.diag(self.precision))

    def standard_errors(self, variance: float) -> dict[str, float]:
        """Posterior standard deviation of every free parameter, in its unit."""
        deviation = np.sqrt(np.diag(self.covariance(variance)))
        return dict(zip(self.names, (deviation * self.scales).tolist(), strict=True))


def decomposed(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(eigenvalues, eigenvectors, size) of normal equations, scaled to a diagonal of one by `size`.

    Where columns are one to rounding, as of unknowns of which the runs show the product alone, an eigenvalue comes out as zero or less:
    it is taken as `ROUNDING`.
    """
    size = 1.0 / np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix * np.outer(size, size))
    return np.maximum(values, ROUNDING), vectors, size


def fitted_model(
    joint: JointParameters, effects: tuple[str, ...], values: np.ndarray, program: Sequence[str]
) -> FittedModel:
    """`effects` at their fitted `values` (P,). `program`: effects of the program that computes it, these among them."""
    names = joint.free(effects)
    problem, index = joint.restricted(program)
    residual, columns = residual_and_columns(problem.with_mean_slopes(), values[index], names)
    at = {name: float(values[joint.slots[name]]) for name in names}
    scales = np.asarray([joint.scale(name, at[name]) for name in names])
    matrix = np.stack([columns[name] for name in names], axis=1) * scales if names else np.zeros((len(residual), 0))
    deviations = np.asarray([joint.deviation(name, at[name]) for name in names])
    precision = np.asarray([joint.precision(name) for name in names])
    factors = {}
    for effect in effects:
        own = [names.index(name) for name in joint.coefficients[effect]]
        factors[effect] = width_factor(deviations[own])
        precision[own] = factors[effect] ** -2
    log_prior = sum(joint.log_odds[effect] - 2.0 * math.log(factors[effect]) for effect in effects)
    log_prior -= 0.5 * float(np.sum(deviations**2 * precision))
    mask = np.asarray(joint.problem.batch.mask)
    correlation = min(correlation_time(split_runs(on_samples(residual, mask), mask)), LONGEST)
    return FittedModel(
        effects=effects,
        values=np.asarray(values),
        names=tuple(names),
        scales=scales,
        squares=float(residual @ residual),
        gram=matrix.T @ matrix,
        precision=precision,
        width_factors=factors,
        log_prior=log_prior,
        one_sided=tuple((k, float(deviations[k])) for k, name in enumerate(names) if joint.one_sided(name)),
        residual=residual,
        rms=float(np.sqrt(np.mean(residual**2))),
        correlation=correlation,
    )


def width_factor(deviations: np.ndarray) -> float:
    """By how much the prior widths of one effect are widened: its coefficients lie so many widths from their base values."""
    return max(1.0, float(np.sqrt(np.mean(np.square(deviations))))) if len(deviations) else 1.0


def independent_error(model: FittedModel, noise: float, noise_given: bool) -> float:
    """What an independent sample may be off by, given what `model` leaves: the noise, or the residual where it is larger; SI."""
    if not noise_given:
        return max(LEAST_NOISE * noise, model.rms * float(np.sqrt(model.correlation)))
    level = model.rms if model.rms > NOISE_EXCESS * noise else noise
    return max(noise, level * float(np.sqrt(model.correlation)))
