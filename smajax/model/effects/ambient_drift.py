"""Ambient temperature that drifts during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar


class AmbientDrift(AbstractEffect):
    r"""$T_\infty(t) = T_\infty + a t$ from the start of each run."""

    rate: Scalar = parameter("K/s", -0.5, 0.5, "a: rise of the ambient temperature during a run; a box warms by less")

    effect_name: ClassVar[str] = "ambient_drift"
    title: ClassVar[str] = "ambient drift"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = "T_inf(t) = T_inf + a t within each run, in eq. 3.1"
    sentence: ClassVar[str] = "The air around the wire warms up (or cools) while a run lasts, as in a closed box."
    switches: ClassVar[tuple[str, ...]] = ("rate",)
    starts: ClassVar[dict[str, float]] = {"rate": 0.02}

    @classmethod
    def base(cls) -> AmbientDrift:
        return cls(rate=0.0)

    def ambient_shift(self, time: Scalar) -> Scalar | float:
        return self.rate * time
