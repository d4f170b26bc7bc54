"""An estimator over a recorded run. `jit`, `vmap` and `grad` stay outside."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import MeasuredState
from smajax.model.types import Scalar, Series


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

    def body(memory: Any, now: tuple[Scalar, Scalar]) -> tuple[Any, tuple[Any, MeasuredState]]:
        memory, told = estimator.step(memory, *now, span)
        return memory, (memory, told)

    first = estimator.start(readings[0])
    _, rest = lax.scan(body, first[0], (readings[1:], voltages[:-1]))
    memories, told = jax.tree.map(lambda one, more: jnp.concatenate([one[None], more]), first, rest)
    return memories, told
