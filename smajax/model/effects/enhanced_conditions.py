"""The stress rate in the branch conditions: the source's own discovery, as a share that data can tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.conditions import Enhanced

if TYPE_CHECKING:
    from smajax.model.system import System
    from smajax.model.wire.conditions import AbstractConditions


class EnhancedConditions(AbstractEffect):
    r"""$\xi = (1 - s)\,\xi_{law} + s\,\xi_{enh}$: the share s of the wire asks for $\dot T - \dot\sigma/C$ in the place of $\dot T$.

    On a wire under Liang's conditions (eq. 3.11) s = 0 is Liang's law and s = 1 the enhanced one (eq. 3.17, 3.18). Each
    part carries its own amplitudes; temperature, stress and strain are common. For a model that is under the enhanced
    conditions already there is `liang_conditions`.

    Why a share of the wire, not of the rate: with $\dot T - s \dot\sigma/C > 0$ as the condition no step depends on s
    but by a jump, so that its derivative says nothing; and a wire unloaded at a held temperature (Fig. 3.11c)
    transforms wholly for the smallest s > 0. As a share of the wire s enters smoothly, and its derivative at zero is
    what the enhanced conditions would transform and the law's do not.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "s: share of the wire that follows the enhanced conditions")

    effect_name: ClassVar[str] = "enhanced_conditions"
    title: ClassVar[str] = "stress rate in the branch conditions"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "xi = (1 - s) xi_law + s xi_enh, the latter under dT/dt - (dsigma/dt)/C > 0 and < 0 (Elahinia 2004, eq. 3.17, 3.18)"
    )
    sentence: ClassVar[str] = (
        "A falling stress transforms the wire as a rising temperature does: it goes on contracting when load is taken "
        "off it, even while it cools."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.5}

    @classmethod
    def base(cls) -> EnhancedConditions:
        return cls(share=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return not isinstance(system.wire.kinetics.conditions, Enhanced)

    def second_conditions(self) -> tuple[AbstractConditions, Scalar] | None:
        return Enhanced(), self.share
