"""A wire that hangs loose at first: it has to shorten before it pulls."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class LooseStart(AbstractEffect):
    r"""$l = l_0 (1 + \varepsilon) + s$ at the start, where l is the way that the wire spans: no stress until it has shortened by s.

    Of a load that rests on its end stop, which carries it until then. A length below the wire's elastic one takes that much
    off the stress at rest. Each run begins with it anew.
    """

    length: Scalar = parameter("m", 0.0, 0.05, "s: by how much the cold wire is too long at the start of a run")

    effect_name: ClassVar[str] = "loose_start"
    title: ClassVar[str] = "wire that is loose at the start"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "strain = eps - s/l_0 in eq. 3.7, sigma = 0 until it is no longer negative (kinematics of a wire that is too long)"
    )
    sentence: ClassVar[str] = (
        "The wire is mounted too long, or has been stretched: the load stays on its stop until the slack is taken up, and "
        "reaches it again before the wire is cold."
    )
    switches: ClassVar[tuple[str, ...]] = ("length",)
    starts: ClassVar[dict[str, float]] = {"length": 5e-4}

    @classmethod
    def base(cls) -> LooseStart:
        return cls(length=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        load = system.load
        return isinstance(load, AbstractMovingLoad) and bool(float(load.limits()[0]) >= float(load.start()))

    def loose_length(self) -> Scalar | float:
        return self.length
