"""A supply that gives way under load."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class SupplySag(AbstractEffect):
    r"""$I = I_0/(1 + a I_0)$: of the current $I_0$ that is asked for, the supply gives at most $1/a$, softly.

    Unlike a series resistance it takes a share that grows with the command.
    """

    sag: Scalar = parameter("1/A", 0.0, 2.0, "a: one over the largest current of the supply")

    effect_name: ClassVar[str] = "supply_sag"
    title: ClassVar[str] = "supply that sags"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = (
        "I = I_0/(1 + a I_0), I_0 the current asked for, in I^2 R of eq. 3.1 (a soft current limit)"
    )
    sentence: ClassVar[str] = (
        "The supply is too weak: the more current the wire asks for, the smaller the share of it that comes."
    )
    switches: ClassVar[tuple[str, ...]] = ("sag",)
    starts: ClassVar[dict[str, float]] = {"sag": 0.05}

    @classmethod
    def base(cls) -> SupplySag:
        return cls(sag=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return type(system.drive).drawn_current is not AbstractDrive.drawn_current

    def current_sag(self) -> Scalar | float:
        return self.sag
