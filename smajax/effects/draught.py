"""Air that starts to move, or stops, during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.effects.base import AbstractEffect
from smajax.effects.change import changed
from smajax.parameters import parameter
from smajax.types import Scalar


class Draught(AbstractEffect):
    r"""$h_c(t) = h_c\,[1 + r\,s(t)]$ with a smooth step s at a time in the run; as a fan, a door or a cover makes it."""

    change: Scalar = parameter("-", -0.9, 5.0, "r: relative change of h_c")
    time: Scalar = parameter("s", -10.0, 600.0, "middle of the change, from the start of each run")
    width: Scalar = parameter("s", 0.05, 60.0, "width of the change")

    effect_name: ClassVar[str] = "draught"
    title: ClassVar[str] = "draught"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = "h = h_c [1 + r / (1 + exp[(t_0 - t)/w])] in eq. 3.1 (a smooth step in time)"
    sentence: ClassVar[str] = (
        "From some moment of the run on the air moves more (or less) than before: the same power then heats the wire "
        "less (or more)."
    )
    switches: ClassVar[tuple[str, ...]] = ("change",)
    starts: ClassVar[dict[str, float]] = {"change": 0.1, "time": 2.0, "width": 1.0}

    @classmethod
    def base(cls) -> Draught:
        return cls(change=0.0, time=2.0, width=1.0)

    def convection_change(self, time: Scalar) -> Scalar | float:
        return self.change * changed(time, self.time, self.width)
