"""Rate of change of a reading by a filtered difference, for controllers that measure no rate."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp

from smajax.model.types import Scalar


class Rate(eqx.Module):
    """The last reading and the rate made of the readings so far."""

    reading: Scalar
    rate: Scalar  # units of the reading per second


def at_rest(reading: Scalar) -> Rate:
    """Before the first call: nothing moves yet."""
    return Rate(reading, jnp.zeros_like(reading))


def filtered_rate(last: Rate, reading: Scalar, time_constant: Scalar, period: Scalar) -> Rate:
    r"""$\tau \dot r + r = \dot y$ by backward Euler: stable for every `time_constant` (s), a plain difference at 0."""
    rate = (time_constant * last.rate + reading - last.reading) / (time_constant + period)
    return Rate(reading, rate)
