"""Viscous friction beyond what the load declares."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.load.base import AbstractMovingLoad


class ViscousFriction(AbstractEffect):
    r"""$F = b\,v$ along the wire, v the speed of its moving end, beside the load's own damping."""

    coefficient: Scalar = parameter("N s/m", 0.0, 200.0, "b: force per speed of the wire's moving end")

    effect_name: ClassVar[str] = "viscous_friction"
    title: ClassVar[str] = "viscous friction"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = "A_w sigma += b v in eq. 3.13 (3.8: times the lever), beside the damping there is"
    sentence: ClassVar[str] = (
        "The guide (grease, a damper, air) resists in proportion to speed by more than the model has it."
    )
    switches: ClassVar[tuple[str, ...]] = ("coefficient",)
    starts: ClassVar[dict[str, float]] = {"coefficient": 2.0}

    @classmethod
    def base(cls) -> ViscousFriction:
        return cls(coefficient=0.0)

    def resisting_force(self, load: AbstractMovingLoad, displacement: Scalar, speed: Scalar) -> Scalar | float:
        return self.coefficient * speed
