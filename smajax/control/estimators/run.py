"""An estimator over a recorded run. `jit`, `vmap` and `grad` stay outside."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import MeasuredState
from smajax.model.types import Scalar, Series
from smajax.simulation.integrate import Carry, Schedule, integrate
from smajax.simulation.observers import StateTrace


def estimate(
    estimator: AbstractEstimator, readings: Series, voltages: Series, period: Scalar | float
) -> tuple[Any, MeasuredState]:
    """(memory, estimate) at every sample of `readings`, arrays of shape (n, ...); samples are `period` seconds apart.

    `voltages[i]` was held from sample i to sample i + 1, as in `simulate`; the last one is not used. Raises ValueError
    when the two series are not of one length.
    """
    readings, voltages = jnp.asarray(readings, dtype=float), jnp.asarray(voltages, dtype=float)
    if readings.shape != voltages.shape or readings.ndim != 1:
        raise ValueError(
            f"`readings` and `voltages` must be two series of one length, not of the shapes {readings.shape} and "
            f"{voltages.shape}. Use `jax.vmap` over a batch."
        )
    span = jnp.asarray(period, dtype=float)

    def advance(carry: Carry, now: tuple[Scalar, Scalar]) -> Carry:
        return Carry(estimator.step(carry.state[0], *now, span))

    start, steps = Carry(estimator.start(readings[0])), Schedule(readings.size - 1)
    return integrate(advance, start, (readings[1:], voltages[:-1]), steps, (StateTrace(),)).results[0]
