"""Pulses that the circuit smooths: the mean of the square is no longer the duty."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    return "duty" in system.drive.inputs_required


class PwmSmoothing(AbstractEffect, CommandTerm):
    r"""$d \to d\,[1 - w (1 - d)]$: the heating of hard pulses is d, of a current smoothed throughout $d^2$.

    $\overline{I^2} = \overline{I}^2 + \mathrm{var}\,I$, and smoothing takes the share w of the variance $d (1 - d)$ away.
    """

    share: Scalar = parameter(
        "-", 0.0, 1.0, "w: share of the pulses' variance that inductance or a filter takes away", default=0.0
    )

    effect_name: ClassVar[str] = "pwm_smoothing"
    candidate: ClassVar[Candidate] = Candidate(
        title="smoothed pulse-width modulation",
        equation="electrical",
        formula="heating ~ d [1 - w (1 - d)]: mean square of a pulsed current, its variance less by the share w",
        sentence="An inductance or a filter smooths the pulses: a duty of one half heats by less than half of full power.",
        switches=("share",),
        initial_guess={"share": 0.1},
        applies=_applies,
        prior_class="bench",
        widths={
            "share": Width(0.3, "inductance and filters take any share from 0 to 1"),
        },
    )

    def command(self, channel: str, value: Scalar) -> Scalar:
        return value * (1.0 - self.share * (1.0 - value)) if channel == "duty" else value
