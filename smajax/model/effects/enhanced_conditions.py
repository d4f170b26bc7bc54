"""The stress rate in the branch conditions: the source's own discovery, as a share that data can determine."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.conditions import AbstractConditions, Enhanced
from smajax.model.wire.kinetics_terms import PopulationTerm


def _applies(system: Actuator) -> bool:
    return not isinstance(system.wire.kinetics.conditions, Enhanced)


class EnhancedConditions(AbstractEffect, PopulationTerm):
    r"""$\xi = (1 - s)\,\xi_{law} + s\,\xi_{enh}$: the share s of the wire asks for $\dot T - \dot\sigma/C$ in the place of $\dot T$.

    On a wire under Liang's conditions (eq. 3.11) s = 0 is Liang's law and s = 1 the enhanced one (eq. 3.17, 3.18). Each
    part carries its own amplitudes; temperature, stress and strain are common. For a model that is under the enhanced
    conditions already there is `liang_conditions`.

    Why a share of the wire, not of the rate: with $\dot T - s \dot\sigma/C > 0$ as the condition no step depends on s
    but by a jump, so that its derivative says nothing; and a wire unloaded at a held temperature (Fig. 3.11c)
    transforms wholly for the smallest s > 0. As a share of the wire s enters smoothly, and its derivative at zero is
    what the enhanced conditions would transform and the law's do not.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "s: share of the wire that follows the enhanced conditions", default=0.0)

    effect_name: ClassVar[str] = "enhanced_conditions"
    candidate: ClassVar[Candidate] = Candidate(
        title="stress rate in the branch conditions",
        equation="kinetics",
        formula="xi = (1 - s) xi_law + s xi_enh, the latter under dT/dt - (dsigma/dt)/C > 0 and < 0 (Elahinia 2004, eq. 3.17, 3.18)",
        sentence="A falling stress transforms the wire as a rising temperature does: it goes on contracting when load is taken "
        "off it, even while it cools.",
        switches=("share",),
        initial_guess={"share": 0.5},
        applies=_applies,
        prior_class="material",
        widths={
            "share": Width(0.5, "all of a wire follows them (Elahinia 2004, eq. 3.17 and 3.18)"),
        },
    )

    def second_conditions(self) -> tuple[AbstractConditions, Scalar]:
        return Enhanced(), self.share
