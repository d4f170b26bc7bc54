"""Specific heat that differs between the phases."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar
from smajax.wire.heat import mass_per_metre

if TYPE_CHECKING:
    from smajax.wire.wire import Wire


class PhaseSpecificHeat(AbstractEffect):
    r"""$c_p = c_p^M [1 + a (1 - \xi)]$, stored as heat $m c_p^M a (1 - \xi)(T - T_0)$, so that energy is conserved.

    The latent heat then depends on temperature by Kirchhoff's law; it is that of the base model at the equilibrium
    temperature $T_0 = (M_s + A_f)/2$ (Tong and Wayman 1974).
    """

    # Beyond this the change of the latent heat alone, far from T_0, would turn a transformation into a jump.
    contrast: Scalar = parameter("-", -0.3, 0.3, "a: relative change of c_p from martensite to austenite")

    effect_name: ClassVar[str] = "phase_specific_heat"
    title: ClassVar[str] = "specific heat depending on the phase"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = (
        "H = m c_p {T + a (1 - xi) [T - (M_s + A_f)/2]} in eq. 3.1 (Kirchhoff; T_0 after Tong and Wayman 1974)"
    )
    sentence: ClassVar[str] = (
        "A hot wire takes more (or less) heat a degree than a cold one: it warms up and cools down at another pace "
        "after its transformation than before, and rests at the same temperature."
    )
    switches: ClassVar[tuple[str, ...]] = ("contrast",)
    starts: ClassVar[dict[str, float]] = {"contrast": 0.05}

    @classmethod
    def base(cls) -> PhaseSpecificHeat:
        return cls(contrast=0.0)

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        law = wire.kinetics
        beyond = temperature - 0.5 * (law.martensite_start + law.austenite_finish)
        return mass_per_metre(wire) * wire.heat.specific_heat * self.contrast * (1.0 - fraction) * beyond
