"""Friction that grows with the load and is larger at rest than in motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import PRESLIDING, AbstractEffect
from smajax.model.effects.coulomb_friction import presliding_parameter
from smajax.model.effects.pulley_friction import PulleyFriction
from smajax.model.effects.stribeck_friction import all_over, falling
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class PulleyStribeckFriction(AbstractEffect):
    r"""$\mu(v)\,|F_{load}|$, $\mu = \mu_s\,[r + (1 - r)\,e^{-(v/v_s)^2}]$: `PulleyFriction` with the curve of `StribeckFriction`.

    Only where the load changes from run to run can it be told from a friction of one size.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "mu_s: friction at rest, to break away, over the load at rest")
    sliding: Scalar = parameter("-", 0.01, 1.0, "r: friction in motion over that at rest")
    speed: Scalar = parameter("m/s", 1e-5, 1.0, "v_s: speed of the wire's moving end about which the friction falls")
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "pulley_stribeck_friction"
    title: ClassVar[str] = "Stribeck friction that grows with the load"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "inertia a + resistance + mu_s [r + (1 - r) exp(-(v/v_s)^2)] F_load sign(v) = lever A_w sigma "
        "(Stribeck curve in its usual Gaussian form, presliding as in LuGre, Canudas de Wit 1995)"
    )
    sentence: ClassVar[str] = (
        "A pulley or a bearing rubs, the more the heavier the load, and more at rest than in motion: the load sticks at "
        "every change of direction and jumps when it starts."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    jumps: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"share": 0.02, "sliding": 0.5, "speed": 5e-3, "bend": PRESLIDING}

    @classmethod
    def base(cls) -> PulleyStribeckFriction:
        return cls(share=0.0, sliding=0.5, speed=5e-3, bend=PRESLIDING)

    @classmethod
    def begins(cls, told: Mapping[str, float]) -> dict[str, tuple[float, float]]:
        return all_over(told, "share")

    @classmethod
    def applies(cls, system: System) -> bool:
        return PulleyFriction.applies(system)

    def friction_share(self) -> Scalar | float:
        return self.share

    def friction_level(self, speed: Scalar) -> Scalar | float:
        return falling(speed, self.sliding, self.speed)

    def presliding(self) -> Scalar | float:
        return self.bend
