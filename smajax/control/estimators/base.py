"""The contract of an estimator: from readings of the position and the command held, to what a controller is told."""

from __future__ import annotations

import abc
from typing import Any, Self

import equinox as eqx

from smajax.control.measured_state import MeasuredState
from smajax.model.types import Scalar


class AbstractEstimator(eqx.Module):
    """Sampled with the controller."""

    @abc.abstractmethod
    def start(self, reading: Scalar) -> tuple[Any, MeasuredState]:
        """(memory, first estimate) from the first reading and what the estimator believes of the state at rest."""

    @abc.abstractmethod
    def step(self, memory: Any, reading: Scalar, voltage: Scalar, period: Scalar) -> tuple[Any, MeasuredState]:
        """(memory, estimate) at `reading`, after `voltage` was held for `period` seconds."""

    def with_reading_noise(self, noise: float) -> Self:
        """The same for readings with this standard deviation, in their own unit (rad or m), more than 0.

        A noise that differs by a thousandth at most from the one that it has may leave that. By default itself: an estimator without a variance of the reading, or whose variance is none of the sensor's.
        """
        return self
