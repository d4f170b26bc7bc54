"""A threshold of the drive: small commands do not come through."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class DeadZone(AbstractEffect):
    r"""$u \to u - \delta\,u/(|u| + \delta)$: next to nothing below the threshold, $u - \delta$ far above it.

    Smooth, so that the threshold can be found by gradients: at the threshold itself half of the command comes through.
    """

    threshold: Scalar = parameter(
        "-", 0.0, 2.0, "delta: command that is lost, a number of V, A, W or duty as the drive's channel is"
    )

    effect_name: ClassVar[str] = "dead_zone"
    title: ClassVar[str] = "dead zone of the drive"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = "u -> u - delta u/(|u| + delta) (a dead zone, smoothed)"
    sentence: ClassVar[str] = (
        "The amplifier passes nothing until its command is beyond a threshold (a diode, a switch that opens late), and "
        "that much less from there on."
    )
    switches: ClassVar[tuple[str, ...]] = ("threshold",)
    starts: ClassVar[dict[str, float]] = {"threshold": 0.02}

    @classmethod
    def base(cls) -> DeadZone:
        return cls(threshold=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return bool(system.drive.inputs_required)

    def command(self, channel: str, value: Scalar) -> Scalar:
        size = jnp.abs(value)
        # Without a command nothing is lost; and no 0/0 where there is no threshold either.
        return value - self.threshold * value / (jnp.where(size > 0.0, size, 1.0) + self.threshold)
