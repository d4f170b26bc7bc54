"""Two-part transformation: a sharp core and long tails."""

from __future__ import annotations

from typing import ClassVar

import jax

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar


class TwoPartTransformation(AbstractEffect):
    r"""$h = (1 - w) h_{core} + w / (1 + e^{(z - 1/2 - s)/b})$ with its own w and s by branch and one width b.

    A transformation in two steps too, as by the R-phase on cooling: `cooling_weight` of the wire transforms in a range of
    its own, `cooling_shift` ranges from the other. Only its strain is that of martensite here.
    """

    heating_weight: Scalar = parameter("-", 0.0, 0.8, "w on heating: share of the wire that follows the tails")
    cooling_weight: Scalar = parameter("-", 0.0, 0.8, "w on cooling")
    heating_shift: Scalar = parameter("-", -3.0, 3.0, "s on heating: centre of the tails, in ranges from mid-range")
    cooling_shift: Scalar = parameter("-", -3.0, 3.0, "s on cooling")
    width: Scalar = parameter("-", 0.15, 4.0, "b: width of the tails, in transformation ranges")

    effect_name: ClassVar[str] = "two_part_transformation"
    title: ClassVar[str] = "two-part transformation (sharp core, long tails)"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "h = (1 - w) h_cos(z) + w / (1 + exp[(z - 1/2 - s)/b]) in eq. 3.3 and 3.5, w and s by branch"
    )
    sentence: ClassVar[str] = (
        "Most of the wire transforms in a narrow range while a part of it (its ends, its grips, grains of another "
        "orientation) follows over a much wider one."
    )
    switches: ClassVar[tuple[str, ...]] = ("heating_weight", "cooling_weight")
    starts: ClassVar[dict[str, float]] = {
        "heating_weight": 0.15,
        "cooling_weight": 0.15,
        "heating_shift": 0.0,
        "cooling_shift": 0.0,
        "width": 0.8,
    }

    @classmethod
    def base(cls) -> TwoPartTransformation:
        return cls(heating_weight=0.0, cooling_weight=0.0, heating_shift=0.0, cooling_shift=0.0, width=0.8)

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        tail = jax.nn.sigmoid(-(z - 0.5 - self.heating_shift) / self.width)
        return (1.0 - self.heating_weight) * remaining + self.heating_weight * tail

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        tail = jax.nn.sigmoid((z - 0.5 - self.cooling_shift) / self.width)
        return (1.0 - self.cooling_weight) * remaining + self.cooling_weight * tail
