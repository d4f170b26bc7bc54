"""Latent heat of transformation: heat absorbed while martensite turns into austenite and given back on cooling."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatTerm, mass_per_metre
from smajax.model.wire.wire import Wire


class LatentHeat(AbstractEffect, HeatTerm):
    r"""$m c_p \dot T = I^2 R - h_c A_c (T - T_\infty) + m \Delta H \dot\xi$: Table 3.2 prints Delta H, eq. 3.1 leaves it out."""

    enthalpy: Scalar = parameter("J/kg", 0.0, 6e4, "Delta H; NiTi sheets give 1e4 to 3e4", default=0.0)

    effect_name: ClassVar[str] = "latent_heat"
    candidate: ClassVar[Candidate] = Candidate(
        title="latent heat of transformation",
        equation="heat",
        formula="m c_p dT/dt = I^2 R - h_c A_c (T - T_inf) + m dH dxi/dt (Elahinia 2004, Table 3.2; missing in eq. 3.1)",
        sentence="While it transforms the wire absorbs heat without getting warmer, and gives it back on cooling: "
        "both strokes are slower than the heat balance alone says, and the same at rest.",
        switches=("enthalpy",),
        initial_guess={"enthalpy": 1e4},
        prior_class="material",
        widths={
            "enthalpy": Width(
                2e4,
                "Elahinia 2004, Table 3.2, and NiTi data sheets: 24.2 kJ/kg; by composition and cold work 10 to 30 kJ/kg",
            ),
        },
    )

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return -mass_per_metre(wire) * self.enthalpy * fraction
