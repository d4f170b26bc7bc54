"""A recorded input that is not the one that acted: wrong gain or offset."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class InputLevel(AbstractEffect):
    r"""$u = (1 + g)\,u_{rec} + o$ on the channel of the drive, never below zero where the recorded one is not."""

    gain: Scalar = parameter("-", -0.5, 1.0, "g: relative error of the recorded input")
    offset: Scalar = parameter(
        "-", -1.0, 1.0, "o: what is added, a number of V, A, W or duty as the drive's channel is"
    )

    effect_name: ClassVar[str] = "input_level"
    title: ClassVar[str] = "wrong level of the recorded input"
    equation: ClassVar[str] = "input"
    formula: ClassVar[str] = "u = (1 + g) u_recorded + o (calibration line)"
    sentence: ClassVar[str] = (
        "The input was not what the log says: a gain or a zero of the measurement or the amplifier is off."
    )
    switches: ClassVar[tuple[str, ...]] = ("gain", "offset")
    starts: ClassVar[dict[str, float]] = {"gain": 0.03, "offset": 0.02}

    @classmethod
    def base(cls) -> InputLevel:
        return cls(gain=0.0, offset=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return bool(system.drive.inputs_required)

    def command(self, channel: str, value: Scalar) -> Scalar:
        acted = (1.0 + self.gain) * value + self.offset
        return jnp.where((value >= 0.0) & (acted < 0.0), 0.0, acted)
