"""Leads and contacts in series with the wire."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.drive.supply import SeriesTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar


def _applies(system: Actuator) -> bool:
    return type(system.drive).wire_share is not AbstractDrive.wire_share


class LeadResistance(AbstractEffect, SeriesTerm):
    r"""$I = U/(R_w + R_s)$: of the power at voltage U the wire keeps $[R_w/(R_w + R_s)]^2$ (Ohm)."""

    resistance: Scalar = parameter("ohm", 0.0, 10.0, "R_s: leads, crimps and the supply's own resistance", default=0.0)

    effect_name: ClassVar[str] = "lead_resistance"
    candidate: ClassVar[Candidate] = Candidate(
        title="resistance of leads and contacts",
        equation="electrical",
        formula="power of the wire = U^2 R_w/(R_w + R_s)^2 (voltage, duty), P R_w/(R_w + R_s) (power); a current is not touched "
        "(Ohm)",
        sentence="A part of the voltage is lost before the wire: it gets less power than its voltage says, and the less the "
        "lower its own resistance is.",
        switches=("resistance",),
        initial_guess={"resistance": 0.5},
        applies=_applies,
        prior_class="bench",
        widths={
            "resistance": Width(0.5, "two metres of copper lead (0.2 mm2) and two crimps: 0.1 to 0.5 ohm"),
        },
    )

    def series_resistance(self) -> Scalar | float:
        return self.resistance
