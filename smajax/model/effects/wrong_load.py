"""A load that is not the one declared."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar


class WrongLoad(AbstractEffect):
    r"""Weight and springs of the load, its static force, times $1 + \epsilon$; inertia and damping stay."""

    share: Scalar = parameter("-", -0.9, 2.0, "epsilon: relative error of the load's weight and springs")

    effect_name: ClassVar[str] = "wrong_load"
    title: ClassVar[str] = "wrong load"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = "(1 + epsilon) resistance(x, v = 0) in eq. 3.8, 3.13"
    sentence: ClassVar[str] = (
        "The wire carries more (or less) than the experiment says: another mass, a rope that rubs, a spring of another "
        "make."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.05}

    @classmethod
    def base(cls) -> WrongLoad:
        return cls(share=0.0)

    def load_change(self, time: Scalar) -> Scalar | float:
        return self.share
