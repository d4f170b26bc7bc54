"""A load that changes during a run."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.effects.change import STEP_WIDTH, TIME_WIDTH, changed, during
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import EndMotion, ForceTerm
from smajax.model.types import Scalar


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    return during(extent.seconds)


class LoadShift(AbstractEffect, ForceTerm):
    r"""Weight and springs of the load times $1 + \epsilon\,s(t)$, s a smooth step at a time in the run; inertia and damping stay."""

    share: Scalar = parameter("-", -0.9, 2.0, "epsilon: relative change of the load's weight and springs", default=0.0)
    time: Scalar = parameter("s", -10.0, 600.0, "middle of the change, from the start of each run", default=2.0)
    width: Scalar = parameter("s", 0.05, 60.0, "width of the change", default=1.0)

    effect_name: ClassVar[str] = "load_shift"
    candidate: ClassVar[Candidate] = Candidate(
        title="load that shifts",
        equation="mechanics",
        formula="{1 + epsilon / (1 + exp[(t_0 - t)/w])} resistance(x, v = 0) in eq. 3.8, 3.13 (a smooth step in time)",
        sentence="At some moment of the run the load changes: something slips, comes to rest on a support, or is hung on.",
        switches=("share",),
        initial_guess={"share": 0.05, "time": 2.0, "width": 1.0},
        grid=_grid,
        prior_class="event",
        widths={
            "share": Width(0.2, "a weight that is hung on or a support that carries a part: tens of per cent"),
            "time": TIME_WIDTH,
            "width": STEP_WIDTH,
        },
    )

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        return self.share * changed(at.time, self.time, self.width) * at.static_force
