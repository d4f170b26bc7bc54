"""Thermal expansion of either sign, each phase with its own coefficient."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.wire import Wire


class ThermalExpansion(AbstractEffect, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= [\xi \alpha_M + (1 - \xi) \alpha_A](T - T_\infty)$, on top of the base model's theta_T.

    A function of state, so that a closed cycle closes. The printed theta_T = +0.55 MPa/C is an expansion of
    -theta_T/E: -2e-5 (martensite) and -0.7e-5 1/C (austenite); the net coefficient is the sum of the two.
    """

    martensite: Scalar = parameter("1/K", -1.5e-4, 1.5e-4, "alpha_M beyond -theta_T/E_M", default=0.0)
    austenite: Scalar = parameter("1/K", -1.5e-4, 1.5e-4, "alpha_A beyond -theta_T/E_A", default=0.0)

    effect_name: ClassVar[str] = "thermal_expansion"
    candidate: ClassVar[Candidate] = Candidate(
        title="thermal expansion of each phase",
        equation="constitutive",
        formula="strain += [xi alpha_M + (1 - xi) alpha_A] (T - T_inf), beyond theta_T of eq. 3.2",
        sentence="A wire that is hot but no longer transforming changes length with its temperature: with a positive "
        "coefficient it creeps back while the power stays on and first contracts when the power is cut.",
        switches=("martensite", "austenite"),
        initial_guess={"martensite": 1e-5, "austenite": 1e-5},
        prior_class="material",
        widths={
            "martensite": Width(
                2e-5, "NiTi data sheets: 6.6e-6 1/K; less the preset's -theta_T/E_M it is up to 2.6e-5"
            ),
            "austenite": Width(2e-5, "NiTi data sheets: 11e-6 1/K; less the preset's -theta_T/E_A it is up to 1.8e-5"),
        },
    )

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        xi = at.martensite_fraction
        coefficient = xi * self.martensite + (1.0 - xi) * self.austenite
        return coefficient * (at.temperature - wire.heat.ambient_temperature)
