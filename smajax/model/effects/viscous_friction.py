"""Viscous friction beyond what the load declares."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import EndMotion, ForceTerm
from smajax.model.types import Scalar


class ViscousFriction(AbstractEffect, ForceTerm):
    r"""$F = b\,v$ along the wire, v the speed of its moving end, beside the load's own damping."""

    coefficient: Scalar = parameter("N s/m", 0.0, 200.0, "b: force per speed of the wire's moving end", default=0.0)

    effect_name: ClassVar[str] = "viscous_friction"
    candidate: ClassVar[Candidate] = Candidate(
        title="viscous friction",
        equation="mechanics",
        formula="A_w sigma += b v in eq. 3.13 (3.8: times the lever), beside the damping there is",
        sentence="The guide (grease, a damper, air) resists in proportion to speed by more than the model has it.",
        switches=("coefficient",),
        initial_guess={"coefficient": 2.0},
        prior_class="bench",
        widths={
            "coefficient": Width(5.0, "greased guides and small dampers: 1 to 10 N s/m"),
        },
    )

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        return self.coefficient * at.speed
