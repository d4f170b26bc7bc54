"""Coulomb friction of the load's guide."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import LOST_MOTION, Candidate, Width
from smajax.model.load.friction import PRESLIDING, FrictionTerm
from smajax.model.types import Scalar

LIMIT_WIDTH = Width(0.1, "guides and bearings: 0.02 to 0.2 of what they carry", of="load")
BEND_WIDTH = Width(
    2.0,
    "presliding of rough contacts: micrometres to a tenth of a millimetre (Dahl 1968; Canudas de Wit et al. 1995)",
    logarithmic=True,
)


def presliding_parameter() -> Scalar:
    """The field `bend` of every effect of friction: its presliding displacement."""
    about = "delta: motion of the wire's end over which it builds up before the load slips"
    field: Scalar = parameter("m", 1e-6, 1e-3, about, default=PRESLIDING)
    return field


class CoulombFriction(AbstractEffect, FrictionTerm):
    r"""$F_c\,\mathrm{sign}(\dot x)$ against the motion, built up over a small presliding displacement (Dahl 1968)."""

    limit: Scalar = parameter(
        "N", 0.0, 20.0, "F_c: friction force while sliding (N m on an arm)", of_load="force", default=0.0
    )
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "coulomb_friction"
    candidate: ClassVar[Candidate] = Candidate(
        title="Coulomb friction",
        equation="mechanics",
        formula="inertia a + resistance + F_c sign(v) = lever A_w sigma (eq. 3.8, 3.13; presliding after Dahl 1968)",
        sentence="The guide sticks: the load stays where it is until the force has changed by twice the friction, at every "
        "change of direction.",
        switches=("limit",),
        initial_guess={"limit": 0.1, "bend": PRESLIDING},
        prior_class="bench",
        similar_group=LOST_MOTION,
        widths={
            "limit": LIMIT_WIDTH,
            "bend": BEND_WIDTH,
        },
    )

    def friction_limit(self, load_at_rest: Scalar) -> Scalar:
        return self.limit

    def presliding(self) -> Scalar | float:
        return self.bend
