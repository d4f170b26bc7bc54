"""An estimator over a recorded run. `jit`, `vmap` and `grad` stay outside."""

from __future__ import annotations

import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.estimators.adaptive_filter import AdaptiveFilter
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.model_filter import ModelFilter
from smajax.control.estimators.printed_filter import PrintedFilter
from smajax.control.measured_state import MeasuredState
from smajax.control.position_unit import beyond_ends
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Scalar, Series
from smajax.simulation.integrate import Carry, Schedule, integrate
from smajax.simulation.observers import StateTrace

BEYOND = 0.1  # of the way between the end stops


class ReadingsWarning(UserWarning):
    """Readings lie where the load cannot be: another unit, another zero, or another load."""


def estimate(
    estimator: AbstractEstimator, readings: Series | np.ndarray, voltages: Series | np.ndarray, period: Scalar | float
) -> tuple[Any, MeasuredState]:
    """(memory, estimate) at every sample of `readings`, arrays of shape (n, ...); samples are `period` seconds apart.

    `voltages[i]` was held from sample i to sample i + 1, as in `simulate`; the last one is not used. A reading of NaN is a
    missing one, which corrects nothing. A ReadingsWarning says of readings that the load cannot have: SI, an angle in rad. Raises
    ValueError when the two series are not of one length, where the first reading is missing, and for a missing one with the filter
    `printed`, which takes rates from readings.
    """
    readings, voltages = jnp.asarray(readings, dtype=float), jnp.asarray(voltages, dtype=float)
    if readings.shape != voltages.shape or readings.ndim != 1:
        raise ValueError(
            f"`readings` and `voltages` must be two series of one length, not of the shapes {readings.shape} and "
            f"{voltages.shape}. Use `jax.vmap` over a batch."
        )
    _check(estimator, readings)
    span = jnp.asarray(period, dtype=float)

    def advance(carry: Carry, now: tuple[Scalar, Scalar]) -> Carry:
        return Carry(estimator.step(carry.state[0], *now, span))

    start, steps = Carry(estimator.start(readings[0])), Schedule(readings.size - 1)
    return integrate(advance, start, (readings[1:], voltages[:-1]), steps, (StateTrace(),)).results[0]


def _check(estimator: AbstractEstimator, readings: Series) -> None:
    """Of a log at hand; within `jit` nothing is known of it."""
    if isinstance(readings, jax.core.Tracer):
        return
    values = np.asarray(readings)
    if np.isnan(values[0]):
        raise ValueError("the first of `readings` is NaN: a filter begins at a reading. Begin the log at one.")
    if np.isnan(values).any() and isinstance(estimator, PrintedFilter):
        raise ValueError(
            f"{int(np.isnan(values).sum())} of `readings` are NaN, and the filter `printed` takes rates from their differences: "
            "fill them, or take `model` or `adaptive`."
        )
    believed = estimator.filter if isinstance(estimator, AdaptiveFilter) else estimator
    load = believed.system.load if isinstance(believed, ModelFilter | PrintedFilter) else None
    if not isinstance(load, AbstractMovingLoad):
        return
    ends = [load.sensed(jnp.asarray(end)) for end in load.limits()]
    if any(isinstance(end, jax.core.Tracer) for end in ends):
        return
    low, high = sorted(float(end) for end in ends)
    unit = load.reading[1]
    if np.isfinite(high - low) and (beyond := beyond_ends(values, (low, high), BEYOND)):
        warnings.warn(
            f"`readings` go from {beyond[0]:.4g} to {beyond[1]:.4g} {unit}, and the load from {low:.4g} to {high:.4g} {unit}: are they in {unit}?",
            ReadingsWarning,
            stacklevel=3,
        )
