"""A spring of the load that is no straight line."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import EndMotion, ForceTerm
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    load = system.load
    return isinstance(load, AbstractMovingLoad) and type(load).spring_rate is not AbstractMovingLoad.spring_rate


class NonlinearSpring(AbstractEffect, ForceTerm):
    r"""$F \mathrel{+}= a k x^3/(x^2 + x_r^2)$: cubic at first, and a stiffness of $(1 + a) k$ far beyond $x_r$. It is steepest at $3 x_r^2 = x^2$,
    by 9/8 of a, so the spring stays one for a > -8/9.

    A cubic without end would turn a softening spring around.
    """

    change: Scalar = parameter("-", -0.88, 20.0, "a: relative change of the stiffness; > 0: it stiffens", default=0.0)
    displacement: Scalar = parameter(
        "m", 1e-3, 0.2, "x_r: displacement from the start over which it changes", default=0.01
    )

    effect_name: ClassVar[str] = "nonlinear_spring"
    candidate: ClassVar[Candidate] = Candidate(
        title="nonlinear spring",
        equation="mechanics",
        formula="k x + a k x^3/(x^2 + x_r^2) in the place of k x in eq. 3.8, 3.13 (a cubic that levels off)",
        sentence="The spring gets stiffer (or softer) as it is stretched: the end of the stroke is shorter (or longer) than its "
        "beginning promises.",
        switches=("change",),
        initial_guess={"change": 0.1, "displacement": 0.01},
        applies=_applies,
        prior_class="bench",
        widths={
            "change": Width(
                0.2,
                "coil springs: a few per cent over the middle of their travel, more towards its ends; rubber: half",
            ),
            "displacement": Width(1.0, "stroke of a wire of 0.1 to 1 m: 3 to 30 mm", logarithmic=True),
        },
    )

    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        square = at.displacement**2
        return self.change * load.spring_rate() * at.displacement * square / (square + self.displacement**2)
