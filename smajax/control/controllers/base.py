"""The contract of a controller: what it remembers, and what it asks of the amplifier once every control period."""

from __future__ import annotations

import abc
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.parameters import get_parameters, parameters
from smajax.model.types import Scalar


class AbstractController(eqx.Module):
    """Sampled: called once a period, its command held until the next call."""

    @abc.abstractmethod
    def start(self, measured: MeasuredState, wanted: Reference) -> Any:
        """The memory before the first call, a pytree of arrays."""

    @abc.abstractmethod
    def step(self, memory: Any, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Any, Scalar]:
        """(memory after the call, voltage to hold). `period` is the time until the next call, s."""

    def largest_command(self) -> Scalar:
        """The largest command that it may ask for, in the unit of the drive's; infinite where it does not say.

        By default the least of its parameters with `limits_command=True` (`smajax.core.parameters.parameter`).
        """
        names = limits_of(self)
        return jnp.min(get_parameters(self, names)) if names else jnp.asarray(jnp.inf)


def limits_of(controller: eqx.Module) -> list[str]:
    """The parameters of a controller that limit its command."""
    return [name for name, entry in parameters(controller).items() if entry.limits_command]
