"""Prescribed electrical power, as a controlled supply or a heat balance in a paper gives it."""

from __future__ import annotations

from typing import ClassVar

from smajax.model.drive.base import AbstractDrive
from smajax.model.types import Inputs, Scalar


class Power(AbstractDrive):
    r"""$P / l_0$ per metre, whatever the resistance."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"power"})
    command: ClassVar[tuple[str, str]] = ("power", "W")

    def power(self, resistance: Scalar, length: Scalar, inputs: Inputs) -> Scalar:
        return inputs["power"] / length

    def wire_share(self, own: Scalar, series: Scalar | float) -> Scalar:
        # The power is that at the supply's terminals.
        return own / (own + series)

    def from_command(self, command: Scalar) -> Inputs:
        return {"power": command}
