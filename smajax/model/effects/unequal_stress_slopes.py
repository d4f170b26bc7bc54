"""Another stress slope on cooling than on heating."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire.kinetics import cooling_width, heating_width

if TYPE_CHECKING:
    from smajax.model.wire.kinetics import Kinetics


class UnequalStressSlopes(AbstractEffect):
    r"""$y_A = T - (1 + a) \sigma/C_A$, $y_M = T - (1 + b) \sigma/C_M$: stress moves each range by an amount of its own.

    C_A and C_M are parameters of the base model and equal in every preset; this says that they differ, from the preset's
    and from each other. Where an experiment fits one of them, that parameter tells it all and the coefficient nothing.
    """

    heating: Scalar = parameter("-", -0.8, 3.0, "a: how much more the heating range moves with stress than C_A says")
    cooling: Scalar = parameter("-", -0.8, 3.0, "b: how much more the cooling range moves with stress than C_M says")

    effect_name: ClassVar[str] = "unequal_stress_slopes"
    title: ClassVar[str] = "unequal stress slopes"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "y_A = T - (1 + a) sigma/C_A in eq. 3.3, y_M = T - (1 + b) sigma/C_M in eq. 3.5 (C_A and C_M of their own: Liang and "
        "Rogers 1990)"
    )
    sentence: ClassVar[str] = (
        "A heavier load moves the cooling stroke by another number of degrees than the heating stroke: the hysteresis "
        "gets wider or narrower with the load."
    )
    switches: ClassVar[tuple[str, ...]] = ("heating", "cooling")
    starts: ClassVar[dict[str, float]] = {"heating": 0.1, "cooling": 0.1}

    @classmethod
    def base(cls) -> UnequalStressSlopes:
        return cls(heating=0.0, cooling=0.0)

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.heating * stress / (law.stress_slope_austenite * heating_width(law))

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.cooling * stress / (law.stress_slope_martensite * cooling_width(law))
