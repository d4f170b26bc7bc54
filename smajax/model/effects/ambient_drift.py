"""Ambient temperature that drifts during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatTerm


class AmbientDrift(AbstractEffect, HeatTerm):
    r"""$T_\infty(t) = T_\infty + a t$ from the start of each run."""

    rate: Scalar = parameter(
        "K/s", -0.5, 0.5, "a: rise of the ambient temperature during a run; a box warms by less", default=0.0
    )

    effect_name: ClassVar[str] = "ambient_drift"
    candidate: ClassVar[Candidate] = Candidate(
        title="ambient drift",
        equation="heat",
        formula="T_inf(t) = T_inf + a t within each run, in eq. 3.1",
        sentence="The air around the wire warms up (or cools) while a run lasts, as in a closed box.",
        switches=("rate",),
        initial_guess={"rate": 0.02},
        prior_class="event",
        widths={
            "rate": Width(2.0, "a closed room or box beside a heated wire: 1 to 3 K while a run lasts", of="1/run"),
        },
    )

    def ambient_shift(self, time: Scalar) -> Scalar | float:
        return self.rate * time
