"""Rounded start and finish: a part of the wire transforms over a wider range."""

from __future__ import annotations

from typing import ClassVar

from smajax.effects.base import AbstractEffect, Extent
from smajax.parameters import parameter
from smajax.types import Scalar
from smajax.wire.shape import Cosine

WIDER = 2.5  # ranges: where a search begins


class SmoothTransformation(AbstractEffect):
    r"""$h = (1 - w) h(z) + w h_{cos}\big((z - 1/2)/b + 1/2\big)$, the same middle and no corner at the ends."""

    weight: Scalar = parameter("-", 0.0, 1.0, "w: share of the wire with the wider range")
    width: Scalar = parameter("-", 1.2, 10.0, "b: the wider range over the other")

    effect_name: ClassVar[str] = "smooth_transformation"
    title: ClassVar[str] = "smooth transformation"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = "h = (1 - w) h(z) + w h_cos((z - 1/2)/b + 1/2) in eq. 3.3 and 3.5, z the reduced distance"
    sentence: ClassVar[str] = (
        "The transformation starts before A_s and ends after A_f (and the same on cooling): grains of a real wire "
        "do not switch at one temperature."
    )
    switches: ClassVar[tuple[str, ...]] = ("weight",)
    starts: ClassVar[dict[str, float]] = {"weight": 0.3, "width": WIDER}

    @classmethod
    def base(cls) -> SmoothTransformation:
        return cls(weight=0.0, width=WIDER)

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        return {"width": 1.6}, {"width": 5.0}

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        wider = Cosine().martensite_left((z - 0.5) / self.width + 0.5)
        return (1.0 - self.weight) * remaining + self.weight * wider

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        wider = Cosine().austenite_left((z - 0.5) / self.width + 0.5)
        return (1.0 - self.weight) * remaining + self.weight * wider
