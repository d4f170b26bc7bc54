"""A recorded input that acted later than the log says."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import InputLagTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import DELAY, Actuator, Candidate, Width, has_command
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    return has_command(system) or isinstance(system.load, AbstractCoupon)


class InputDelay(AbstractEffect, InputLagTerm):
    r"""$u(t) = u_{rec}(t - \tau)$; a held input then switches within a step, which is integrated in two parts.

    On a whole recorded series (`simulate`, a batch or a fit); a closed loop has a delay of its own.
    """

    delay: Scalar = parameter("s", -0.5, 2.0, "tau; < 0: the log is late", default=0.0)

    effect_name: ClassVar[str] = "input_delay"
    candidate: ClassVar[Candidate] = Candidate(
        title="delay of the recorded input",
        equation="input",
        formula="u(t) = u_recorded(t - tau)",
        sentence="The input and the sensor were not logged on the same clock: what the log shows acted a little later.",
        negative_sentence="The input and the sensor were not logged on the same clock: what the log shows acted a little earlier. "
        "A command that the logger only reads, and does not set, is late by half a sampling interval already.",
        switches=("delay",),
        initial_guess={"delay": 0.03},
        needs_time=True,
        similar_group=DELAY,
        applies=_applies,
        prior_class="bench",
        widths={
            "delay": Width(0.03, "buffers of loggers, serial lines and video: a sample to 0.1 s"),
        },
    )

    def input_lag(self, time: Scalar) -> Scalar | float:
        return self.delay
