"""Air that starts to move, or stops, during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.effects.change import STEP_WIDTH, TIME_WIDTH, changed, during
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatState, HeatTerm, convection
from smajax.model.wire.wire import Wire

NEVER_ENDS = 1000.0  # s
WHILE = 0.25  # of a run


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    ends = {"lasting": NEVER_ENDS}, {"lasting": WHILE * extent.seconds}
    return tuple(place | end for place in during(extent.seconds) for end in ends)


class Draught(AbstractEffect, HeatTerm):
    r"""$h_c(t) = h_c\,[1 + r\,(s(t - t_0) - s(t - t_0 - l))]$, s a smooth step; as a fan, a door or a cover makes it.

    With l longer than the rest of the run it does not end.
    """

    change: Scalar = parameter("-", -0.9, 5.0, "r: relative change of h_c", default=0.0)
    time: Scalar = parameter("s", -10.0, 600.0, "middle of the change, from the start of each run", default=2.0)
    lasting: Scalar = parameter(
        "s", 0.1, 2000.0, "l: from the middle of the change to that of the change back", default=NEVER_ENDS
    )
    width: Scalar = parameter("s", 0.05, 60.0, "width of either change", default=1.0)

    effect_name: ClassVar[str] = "draught"
    candidate: ClassVar[Candidate] = Candidate(
        title="draught",
        equation="heat",
        formula="h = h_c [1 + r (s(t - t_0) - s(t - t_0 - l))], s(t) = 1/(1 + exp[-t/w]), in eq. 3.1 (smooth steps in time)",
        sentence="From some moment of the run on, to its end or for a while, the air moves more (or less) than before: the same "
        "power then heats the wire less (or more).",
        switches=("change",),
        initial_guess={"change": 0.1, "time": 2.0, "lasting": NEVER_ENDS, "width": 1.0},
        grid=_grid,
        prior_class="event",
        widths={
            "change": Width(
                0.3,
                "a thin wire loses 30 % more in air of 0.05 m/s than in still air (Hilpert and Morgan, in Incropera and DeWitt)",
            ),
            "time": TIME_WIDTH,
            "lasting": Width(2.0, "a twentieth of a run or to its end", logarithmic=True, of="run", base=1.0),
            "width": STEP_WIDTH,
        },
    )

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        ended = changed(at.time, self.time + self.lasting, self.width)
        change = self.change * (changed(at.time, self.time, self.width) - ended)
        return change * convection(wire, at.temperature, at.ambient)
