"""Friction that grows with the load: of a pulley, of a bearing."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import PRESLIDING, AbstractEffect
from smajax.model.effects.coulomb_friction import presliding_parameter
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class PulleyFriction(AbstractEffect):
    r"""$F_c = \mu\,|F_{load}|$ with the load at rest at its start, against the motion (presliding as `CoulombFriction`).

    Only where the load changes from run to run can it be told from a friction of one size.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "mu: friction while sliding over the load at rest")
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "pulley_friction"
    title: ClassVar[str] = "friction that grows with the load"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "inertia a + resistance + mu F_load sign(v) = lever A_w sigma (Coulomb, presliding after Dahl 1968)"
    )
    sentence: ClassVar[str] = (
        "A pulley or a bearing rubs, and the more the heavier the load: the load sticks at every change of direction."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.02, "bend": PRESLIDING}

    @classmethod
    def base(cls) -> PulleyFriction:
        return cls(share=0.0, bend=PRESLIDING)

    @classmethod
    def applies(cls, system: System) -> bool:
        return "mass" in system.load.inputs_required | system.load.inputs_optional

    def friction_share(self) -> Scalar | float:
        return self.share

    def presliding(self) -> Scalar | float:
        return self.bend
