"""A recorded input whose clock runs slow or fast."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import InputLagTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width, has_command
from smajax.model.load.coupon import AbstractCoupon
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    return has_command(system) or isinstance(system.load, AbstractCoupon)


class InputClock(AbstractEffect, InputLagTerm):
    r"""$u(t) = u_{rec}(t (1 - r))$: the log of the input falls behind that of the sensor by r seconds a second.

    On a whole recorded series (`simulate`, a batch or a fit); a closed loop refuses it.
    """

    rate: Scalar = parameter(
        "-", -0.05, 0.05, "r: by how much what acts falls behind the log, per second of the run", default=0.0
    )

    effect_name: ClassVar[str] = "input_clock"
    candidate: ClassVar[Candidate] = Candidate(
        title="wrong clock of the recorded input",
        equation="input",
        formula="u(t) = u_recorded(t (1 - r))",
        sentence="Two recorders with two clocks: input and motion fit at the start of a run and drift apart towards its end.",
        switches=("rate",),
        # By 0.005 the command of sample 200 would switch exactly at a sample, where the derivative of fixed steps is one-sided.
        initial_guess={"rate": 0.0047},
        needs_time=True,
        applies=_applies,
        prior_class="event",
        widths={
            "rate": Width(3e-3, "crystals: 1e-4 and less; loops timed by software: up to 1 %"),
        },
    )

    def input_lag(self, time: Scalar) -> Scalar | float:
        return self.rate * time
