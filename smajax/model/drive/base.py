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
    # What a controller commands, and its unit: V, A, or W, by which the power is proportional to the command and not to its square.
    command: ClassVar[tuple[str, str]] = ("voltage", "V")

    @abc.abstractmethod
    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        """I^2 R per metre of wire, W/m; `resistance` in ohm/m, `length` in m."""

    def wire_share(self, own: Scalar, series: Scalar | float) -> Scalar | float:
        """Share of `power` that is left to a wire of `own` ohm behind `series` ohm: all of it, if the drive does not notice."""
        return 1.0

    def drawn_current(self, resistance: Scalar, inputs: Inputs) -> Scalar | float:
        """Current asked of the supply by `resistance` ohm while it is on, A; zero where the drive has no current of its own."""
        return 0.0

    def largest_command(self) -> Scalar | float:
        """Command above which it puts no more into the wire, in the unit of `command`; infinite where there is none."""
        return math.inf

    def from_command(self, command: Scalar) -> Inputs:
        """The inputs by which a controller's command (0 or more) reaches the wire. ValueError for a drive that takes none."""
        return self.from_voltage(command)

    def from_voltage(self, voltage: Scalar) -> Inputs:
        """The same of a command in V. ValueError for a drive of another kind."""
        raise ValueError(
            f"a controller commands a voltage, a current or a power, and {type(self).__name__} takes none: use the drive voltage, duty, "
            "current or power."
        )
