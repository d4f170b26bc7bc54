"""Leads and contacts in series with the wire."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


class LeadResistance(AbstractEffect):
    r"""$I = U/(R_w + R_s)$: of the power at voltage U the wire keeps $[R_w/(R_w + R_s)]^2$ (Ohm)."""

    resistance: Scalar = parameter("ohm", 0.0, 10.0, "R_s: leads, crimps and the supply's own resistance")

    effect_name: ClassVar[str] = "lead_resistance"
    title: ClassVar[str] = "resistance of leads and contacts"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = (
        "power of the wire = U^2 R_w/(R_w + R_s)^2 (voltage, duty), P R_w/(R_w + R_s) (power); a current is not touched "
        "(Ohm)"
    )
    sentence: ClassVar[str] = (
        "A part of the voltage is lost before the wire: it gets less power than its voltage says, and the less the "
        "lower its own resistance is."
    )
    switches: ClassVar[tuple[str, ...]] = ("resistance",)
    starts: ClassVar[dict[str, float]] = {"resistance": 0.5}

    @classmethod
    def base(cls) -> LeadResistance:
        return cls(resistance=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return type(system.drive).wire_share is not AbstractDrive.wire_share

    def series_resistance(self) -> Scalar | float:
        return self.resistance
