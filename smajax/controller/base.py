"""The contract of a controller: what it remembers, and what it asks of the drive once every control period."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx

from smajax.types import Inputs, Scalar, State


class AbstractController(eqx.Module):
    """Sampled: called once a period, its command held until the next call."""

    @abc.abstractmethod
    def start(self, state: State, target: Scalar) -> Any:
        """The memory before the first call, a pytree of arrays."""

    @abc.abstractmethod
    def command(self, memory: Any, state: State, target: Scalar, period: Scalar) -> tuple[Inputs, Any]:
        """(inputs of the drive, memory after the call) for the measured or estimated `state`.

        `target` is the position wanted (rad, m); `period` the time until the next call, s.
        """
