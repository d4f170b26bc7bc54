"""Branch conditions that do not know of the stress rate: the source's first model, as a share that data can tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.conditions import Enhanced, Liang

if TYPE_CHECKING:
    from smajax.model.system import System
    from smajax.model.wire.conditions import AbstractConditions


class LiangConditions(AbstractEffect):
    r"""$\xi = (1 - s)\,\xi_{enh} + s\,\xi_{Liang}$: the share s of the wire asks for $\dot T$ alone.

    The way back from `enhanced_conditions`, for a model that has the enhanced conditions (eq. 3.17, 3.18) already: s = 0 is
    those, s = 1 Liang's (eq. 3.11).
    """

    share: Scalar = parameter("-", 0.0, 1.0, "s: share of the wire that follows Liang's conditions")

    effect_name: ClassVar[str] = "liang_conditions"
    title: ClassVar[str] = "branch conditions without the stress rate"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "xi = (1 - s) xi_enh + s xi_Liang, the latter under dT/dt > 0 and < 0 in the place of dT/dt - (dsigma/dt)/C "
        "(Elahinia 2004, eq. 3.11)"
    )
    sentence: ClassVar[str] = (
        "A change of stress alone does not transform the wire, or less of it than the model says: only heating and cooling "
        "do."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.5}

    @classmethod
    def base(cls) -> LiangConditions:
        return cls(share=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return isinstance(system.wire.kinetics.conditions, Enhanced)

    def second_conditions(self) -> tuple[AbstractConditions, Scalar] | None:
        return Liang(), self.share
