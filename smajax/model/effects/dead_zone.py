"""A threshold of the drive: small commands do not come through."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, has_command
from smajax.model.types import Scalar


class DeadZone(AbstractEffect, CommandTerm):
    r"""$u \to u - \delta\,u/(|u| + \delta)$: next to nothing below the threshold, $u - \delta$ far above it.

    Smooth, so that the threshold can be found by gradients: at the threshold itself half of the command comes through.
    """

    threshold: Scalar = parameter(
        "-", 0.0, 2.0, "delta: command that is lost, a number of V, A, W or duty as the drive's channel is", default=0.0
    )

    effect_name: ClassVar[str] = "dead_zone"
    candidate: ClassVar[Candidate] = Candidate(
        title="dead zone of the drive",
        equation="electrical",
        formula="u -> u - delta u/(|u| + delta) (a dead zone, smoothed)",
        sentence="The amplifier passes nothing until its command is beyond a threshold (a diode, a switch that opens late), and "
        "that much less from there on.",
        switches=("threshold",),
        initial_guess={"threshold": 0.02},
        applies=has_command,
        prior_class="bench",
        widths={
            "threshold": Width(0.1, "output stages: millivolts to the 0.6 V of a diode; a duty of some per cent"),
        },
    )

    def command(self, channel: str, value: Scalar) -> Scalar:
        size = jnp.abs(value)
        # Without a command nothing is lost; and no 0/0 where there is no threshold either.
        return value - self.threshold * value / (jnp.where(size > 0.0, size, 1.0) + self.threshold)
