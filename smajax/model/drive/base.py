"""The contract of a drive: what the amplifier puts into each metre of wire."""

from __future__ import annotations

import abc
import math
from typing import ClassVar

import equinox as eqx

from smajax.model.types import Inputs, Scalar


class AbstractDrive(eqx.Module):
    """Electrical power from the input channels."""

    inputs_required: ClassVar[frozenset[str]]
    inputs_optional: ClassVar[frozenset[str]] = frozenset()
    # Channels that heat by their square: their value over a step is the root of the mean square, not the mean.
    inputs_squared: ClassVar[frozenset[str]] = frozenset()

    @abc.abstractmethod
    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        """I^2 R per metre of wire, W/m; `resistance` in ohm/m, `length` in m."""

    def wire_share(self, own: Scalar, series: Scalar | float) -> Scalar | float:
        """Share of `power` that is left to a wire of `own` ohm behind `series` ohm: all of it, if the drive does not notice."""
        return 1.0

    def drawn_current(self, resistance: Scalar, inputs: Inputs) -> Scalar | float:
        """Current asked of the supply by `resistance` ohm while it is on, A; zero where the drive has no current of its own."""
        return 0.0

    def largest_voltage(self) -> Scalar | float:
        """Command above which it puts no more into the wire, V; infinite where there is none."""
        return math.inf

    def from_voltage(self, voltage: Scalar) -> Inputs:
        """The inputs by which a controller's voltage (V, 0 or more) reaches the wire. ValueError for a drive of another kind."""
        raise ValueError(
            f"a controller asks for a voltage, which {type(self).__name__} does not take: use the voltage or duty drive."
        )
