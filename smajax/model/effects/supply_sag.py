"""A supply that gives way under load."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.drive.base import AbstractDrive
from smajax.model.drive.supply import Circuit, SupplyTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar, WireState


def _applies(system: Actuator) -> bool:
    return type(system.drive).drawn_current is not AbstractDrive.drawn_current


class SupplySag(AbstractEffect, SupplyTerm):
    r"""$I = I_0/(1 + a I_0)$: of the current $I_0$ that is asked for, the supply gives at most $1/a$, softly.

    Unlike a series resistance it takes a share that grows with the command.
    """

    sag: Scalar = parameter("1/A", 0.0, 2.0, "a: one over the largest current of the supply", default=0.0)

    effect_name: ClassVar[str] = "supply_sag"
    candidate: ClassVar[Candidate] = Candidate(
        title="supply that sags",
        equation="electrical",
        formula="I = I_0/(1 + a I_0), I_0 the current asked for, in I^2 R of eq. 3.1 (a soft current limit)",
        sentence="The supply is too weak: the more current the wire asks for, the smaller the share of it that comes.",
        switches=("sag",),
        initial_guess={"sag": 0.05},
        applies=_applies,
        prior_class="bench",
        widths={
            "sag": Width(0.15, "bench supplies and amplifiers: 3 to 20 A at most"),
        },
    )

    def voltage_share(self, circuit: Circuit, old: WireState | None) -> Scalar | float:
        return 1.0 / (1.0 + self.sag * circuit.peak_current)
