"""A spring between wire and load: clamps, rope, frame."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.heat import cross_section
from smajax.model.wire.wire import Wire


class SeriesCompliance(AbstractEffect, ConstitutiveTerm):
    r"""$x_{load} = x_{wire} - c F$ with $F = A_w \sigma$, as strain of the path: $\varepsilon \mathrel{+}= c A_w \sigma/l_0$ (Hooke).

    The strain that the model shows is then that of the whole path, wire and spring.
    """

    compliance: Scalar = parameter(
        "m/N", 0.0, 1e-2, "c: one over the stiffness of what lies between wire and load", default=0.0
    )

    effect_name: ClassVar[str] = "series_compliance"
    candidate: ClassVar[Candidate] = Candidate(
        title="compliance in series with the wire",
        equation="mechanics",
        formula="strain += c A_w sigma/l_0 in eq. 3.7, 3.14: x_load = x_wire - c F (Hooke)",
        sentence="Clamps, rope or frame give way under force: the load moves by less than the wire contracts when the force "
        "rises on the way, and sags when it is loaded.",
        switches=("compliance",),
        initial_guess={"compliance": 1e-4},
        prior_class="bench",
        widths={
            "compliance": Width(2e-4, "crimps, ropes and frames: 3 to 100 N/mm"),
        },
    )

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.compliance * cross_section(wire) * at.stress / wire.wire_length
