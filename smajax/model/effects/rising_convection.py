"""Convection that rises with temperature: a hot wire stirs its own air."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import CONVECTION_OF_TEMPERATURE, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatState, HeatTerm, convection
from smajax.model.wire.wire import Wire


class RisingConvection(AbstractEffect, HeatTerm):
    r"""$h = h_c [1 + a (T - T_\infty)]$, the first term of the free-convection laws in Elahinia 2004, appendix A."""

    # Above -1/400 per degree h stays positive for every wire below 400 C over ambient.
    slope: Scalar = parameter("1/K", -2e-3, 0.05, "a: relative rise of h_c per degree above ambient", default=0.0)

    effect_name: ClassVar[str] = "rising_convection"
    candidate: ClassVar[Candidate] = Candidate(
        title="convection rising with temperature",
        equation="heat",
        formula="h = h_c [1 + a (T - T_inf)] in eq. 3.1 (free convection; Elahinia 2004, appendix A)",
        sentence="The hotter the wire, the better the air takes its heat away: one constant h_c cools too little when hot "
        "and too much when nearly cold.",
        negative_sentence="The hotter the wire, the less well the air takes its heat away: one constant h_c cools too much when hot "
        "and too little when nearly cold.",
        switches=("slope",),
        initial_guess={"slope": 2e-3},
        prior_class="material",
        similar_group=CONVECTION_OF_TEMPERATURE,
        widths={
            "slope": Width(
                4e-3,
                "free convection of a thin wire, h ~ (T - T_inf)^0.06 to ^0.19 (Morgan, in Incropera and DeWitt), 30 to 100 K above the air",
            ),
        },
    )

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        over = at.temperature - at.ambient
        return convection(wire, at.temperature, at.ambient) * self.slope * over
