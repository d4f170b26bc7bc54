"""A spring of the load that is no straight line."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class NonlinearSpring(AbstractEffect):
    r"""$F \mathrel{+}= a k x^3/(x^2 + x_r^2)$: cubic at first, and a stiffness of $(1 + a) k$ far beyond $x_r$. It is steepest at $3 x_r^2 = x^2$,
    by 9/8 of a, so the spring stays one for a > -8/9.

    A cubic without end would turn a softening spring around.
    """

    change: Scalar = parameter("-", -0.88, 20.0, "a: relative change of the stiffness; > 0: it stiffens")
    displacement: Scalar = parameter("m", 1e-3, 0.2, "x_r: displacement from the start over which it changes")

    effect_name: ClassVar[str] = "nonlinear_spring"
    title: ClassVar[str] = "nonlinear spring"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "k x + a k x^3/(x^2 + x_r^2) in the place of k x in eq. 3.8, 3.13 (a cubic that levels off)"
    )
    sentence: ClassVar[str] = (
        "The spring gets stiffer (or softer) as it is stretched: the end of the stroke is shorter (or longer) than its "
        "beginning promises."
    )
    switches: ClassVar[tuple[str, ...]] = ("change",)
    starts: ClassVar[dict[str, float]] = {"change": 0.1, "displacement": 0.01}

    @classmethod
    def base(cls) -> NonlinearSpring:
        return cls(change=0.0, displacement=0.01)

    @classmethod
    def applies(cls, system: System) -> bool:
        load = system.load
        return isinstance(load, AbstractMovingLoad) and type(load).spring_rate is not AbstractMovingLoad.spring_rate

    def resisting_force(self, load: AbstractMovingLoad, displacement: Scalar, speed: Scalar) -> Scalar | float:
        square = displacement**2
        return self.change * load.spring_rate() * displacement * square / (square + self.displacement**2)
