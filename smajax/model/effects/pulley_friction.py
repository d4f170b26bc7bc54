"""Friction that grows with the load: of a pulley, of a bearing."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import LOST_MOTION, Actuator, Candidate, Width
from smajax.model.effects.coulomb_friction import BEND_WIDTH, presliding_parameter
from smajax.model.load.friction import PRESLIDING, FrictionTerm
from smajax.model.types import Scalar

SHARE_WIDTH = Width(
    0.05,
    "ball bearings: 0.005 and less of what they carry, plain bearings and ropes: 0.05 to 0.1",
)


def _applies(system: Actuator) -> bool:
    return "mass" in system.load.inputs_required | system.load.inputs_optional


class PulleyFriction(AbstractEffect, FrictionTerm):
    r"""$F_c = \mu\,|F_{load}|$ with the load at rest at its start, against the motion (presliding as `CoulombFriction`).

    Identifiable beside a friction of one size only where the load changes from run to run.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "mu: friction while sliding over the load at rest", default=0.0)
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "pulley_friction"
    candidate: ClassVar[Candidate] = Candidate(
        title="friction that grows with the load",
        equation="mechanics",
        formula="inertia a + resistance + mu F_load sign(v) = lever A_w sigma (Coulomb, presliding after Dahl 1968)",
        sentence="A pulley or a bearing rubs, and the more the heavier the load: the load sticks at every change of direction.",
        switches=("share",),
        initial_guess={"share": 0.02, "bend": PRESLIDING},
        applies=_applies,
        prior_class="bench",
        similar_group=LOST_MOTION,
        widths={
            "share": SHARE_WIDTH,
            "bend": BEND_WIDTH,
        },
    )

    def friction_limit(self, load_at_rest: Scalar) -> Scalar:
        return self.share * load_at_rest

    def presliding(self) -> Scalar | float:
        return self.bend
