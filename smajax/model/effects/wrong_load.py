"""A load that is not the one declared."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import EndMotion, ForceTerm
from smajax.model.types import Scalar


class WrongLoad(AbstractEffect, ForceTerm):
    r"""Weight and springs of the load, its static force, times $1 + \epsilon$; inertia and damping stay."""

    share: Scalar = parameter("-", -0.9, 2.0, "epsilon: relative error of the load's weight and springs", default=0.0)

    effect_name: ClassVar[str] = "wrong_load"
    candidate: ClassVar[Candidate] = Candidate(
        title="wrong load",
        equation="mechanics",
        formula="(1 + epsilon) resistance(x, v = 0) in eq. 3.8, 3.13",
        sentence="The wire carries more (or less) than the experiment says: another mass, a rope that rubs, a spring of another "
        "make.",
        switches=("share",),
        initial_guess={"share": 0.05},
        prior_class="bench",
        widths={
            "share": Width(
                0.1, "spring rates of coil springs: within 5 to 15 %; a weight that is not weighed: as much"
            ),
        },
    )

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        return self.share * at.static_force
