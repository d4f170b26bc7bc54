"""Coulomb friction of the load's guide."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import PRESLIDING, AbstractEffect
from smajax.model.types import Scalar


def presliding_parameter() -> Scalar:
    """The field `bend` of every effect of friction: its presliding displacement."""
    about = "delta: motion of the wire's end over which it builds up before the load slips"
    field: Scalar = parameter("m", 1e-6, 1e-3, about)
    return field


class CoulombFriction(AbstractEffect):
    r"""$F_c\,\mathrm{sign}(\dot x)$ against the motion, built up over a small presliding displacement (Dahl 1968)."""

    limit: Scalar = parameter("N", 0.0, 20.0, "F_c: friction force while sliding (N m on an arm)")
    bend: Scalar = presliding_parameter()

    effect_name: ClassVar[str] = "coulomb_friction"
    title: ClassVar[str] = "Coulomb friction"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "inertia a + resistance + F_c sign(v) = lever A_w sigma (eq. 3.8, 3.13; presliding after Dahl 1968)"
    )
    sentence: ClassVar[str] = (
        "The guide sticks: the load stays where it is until the force has changed by twice the friction, at every "
        "change of direction."
    )
    switches: ClassVar[tuple[str, ...]] = ("limit",)
    starts: ClassVar[dict[str, float]] = {"limit": 0.1, "bend": PRESLIDING}

    @classmethod
    def base(cls) -> CoulombFriction:
        return cls(limit=0.0, bend=PRESLIDING)

    def friction_limit(self) -> Scalar | float:
        return self.limit

    def presliding(self) -> Scalar | float:
        return self.bend
