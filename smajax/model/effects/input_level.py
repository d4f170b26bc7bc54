"""A recorded input that is not the one that acted: wrong gain or offset."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, has_command
from smajax.model.types import Scalar


class InputLevel(AbstractEffect, CommandTerm):
    r"""$u = (1 + g)\,u_{rec} + o$ on the channel of the drive, never below zero where the recorded one is not."""

    gain: Scalar = parameter("-", -0.5, 1.0, "g: relative error of the recorded input", default=0.0)
    offset: Scalar = parameter(
        "-", -1.0, 1.0, "o: what is added, a number of V, A, W or duty as the drive's channel is", default=0.0
    )

    effect_name: ClassVar[str] = "input_level"
    candidate: ClassVar[Candidate] = Candidate(
        title="wrong level of the recorded input",
        equation="input",
        formula="u = (1 + g) u_recorded + o (calibration line)",
        sentence="The input was not what the log says: a gain or a zero of the measurement or the amplifier is off.",
        switches=("gain", "offset"),
        initial_guess={"gain": 0.03, "offset": 0.02},
        applies=has_command,
        prior_class="event",
        widths={
            "gain": Width(0.05, "shunts, dividers and amplifiers out of calibration: 1 to 10 %"),
            "offset": Width(0.05, "zero of a meter or an amplifier: some hundredths of its unit"),
        },
    )

    def command(self, channel: str, value: Scalar) -> Scalar:
        acted = (1.0 + self.gain) * value + self.offset
        return jnp.where((value >= 0.0) & (acted < 0.0), 0.0, acted)
