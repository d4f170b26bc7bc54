"""Branch conditions that do not know of the stress rate: the source's first model, as a share that data can determine."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.conditions import AbstractConditions, Enhanced, Liang
from smajax.model.wire.kinetics_terms import PopulationTerm


def _applies(system: Actuator) -> bool:
    return isinstance(system.wire.kinetics.conditions, Enhanced)


class LiangConditions(AbstractEffect, PopulationTerm):
    r"""$\xi = (1 - s)\,\xi_{enh} + s\,\xi_{Liang}$: the share s of the wire asks for $\dot T$ alone.

    The way back from `enhanced_conditions`, for a model that has the enhanced conditions (eq. 3.17, 3.18) already: s = 0 is
    those, s = 1 Liang's (eq. 3.11).
    """

    share: Scalar = parameter("-", 0.0, 1.0, "s: share of the wire that follows Liang's conditions", default=0.0)

    effect_name: ClassVar[str] = "liang_conditions"
    candidate: ClassVar[Candidate] = Candidate(
        title="branch conditions without the stress rate",
        equation="kinetics",
        formula="xi = (1 - s) xi_enh + s xi_Liang, the latter under dT/dt > 0 and < 0 in the place of dT/dt - (dsigma/dt)/C "
        "(Elahinia 2004, eq. 3.11)",
        sentence="A change of stress alone does not transform the wire, or less of it than the model says: only heating and cooling "
        "do.",
        switches=("share",),
        initial_guess={"share": 0.5},
        applies=_applies,
        prior_class="bench",
        widths={
            "share": Width(0.5, "all of a wire follows them (Elahinia 2004, eq. 3.11)"),
        },
    )

    def second_conditions(self) -> tuple[AbstractConditions, Scalar]:
        return Liang(), self.share
