"""Latent heat of transformation: heat absorbed while martensite turns into austenite and given back on cooling."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.heat import mass_per_metre

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class LatentHeat(AbstractEffect):
    r"""$m c_p \dot T = I^2 R - h_c A_c (T - T_\infty) + m \Delta H \dot\xi$: Table 3.2 prints Delta H, eq. 3.1 leaves it out."""

    enthalpy: Scalar = parameter("J/kg", 0.0, 6e4, "Delta H; NiTi sheets give 1e4 to 3e4")

    effect_name: ClassVar[str] = "latent_heat"
    title: ClassVar[str] = "latent heat of transformation"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = (
        "m c_p dT/dt = I^2 R - h_c A_c (T - T_inf) + m dH dxi/dt (Elahinia 2004, Table 3.2; missing in eq. 3.1)"
    )
    sentence: ClassVar[str] = (
        "While it transforms the wire absorbs heat without getting warmer, and gives it back on cooling: "
        "both strokes are slower than the heat balance alone says, and the same at rest."
    )
    switches: ClassVar[tuple[str, ...]] = ("enthalpy",)
    starts: ClassVar[dict[str, float]] = {"enthalpy": 1e4}

    @classmethod
    def base(cls) -> LatentHeat:
        return cls(enthalpy=0.0)

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return -mass_per_metre(wire) * self.enthalpy * fraction
