"""The contract of a controller: what it remembers, and what it asks of the amplifier once every control period."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx

from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.model.types import Scalar


class AbstractController(eqx.Module):
    """Sampled: called once a period, its command held until the next call."""

    @abc.abstractmethod
    def start(self, measured: MeasuredState, wanted: Reference) -> Any:
        """The memory before the first call, a pytree of arrays."""

    @abc.abstractmethod
    def step(self, memory: Any, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Any, Scalar]:
        """(memory after the call, voltage to hold). `period` is the time until the next call, s."""
