"""A load that changes during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.effects.change import changed, during
from smajax.model.types import Scalar


class LoadShift(AbstractEffect):
    r"""Weight and springs of the load times $1 + \epsilon\,s(t)$, s a smooth step at a time in the run; inertia and damping stay."""

    share: Scalar = parameter("-", -0.9, 2.0, "epsilon: relative change of the load's weight and springs")
    time: Scalar = parameter("s", -10.0, 600.0, "middle of the change, from the start of each run")
    width: Scalar = parameter("s", 0.05, 60.0, "width of the change")

    effect_name: ClassVar[str] = "load_shift"
    title: ClassVar[str] = "load that shifts"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "{1 + epsilon / (1 + exp[(t_0 - t)/w])} resistance(x, v = 0) in eq. 3.8, 3.13 (a smooth step in time)"
    )
    sentence: ClassVar[str] = (
        "At some moment of the run the load changes: something slips, comes to rest on a support, or is hung on."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.05, "time": 2.0, "width": 1.0}

    @classmethod
    def base(cls) -> LoadShift:
        return cls(share=0.0, time=2.0, width=1.0)

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        return during(extent.seconds)

    def load_change(self, time: Scalar) -> Scalar | float:
        return self.share * changed(time, self.time, self.width)
