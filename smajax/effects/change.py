"""A change at some time during a run, smooth so that its time can be found by gradients."""

from __future__ import annotations

import jax

from smajax.types import Scalar


def changed(time: Scalar, middle: Scalar, width: Scalar) -> Scalar:
    """Share of the change that has happened at `time` (s): a logistic step, a quarter to three quarters in 2.2 `width`."""
    return jax.nn.sigmoid((time - middle) / width)
