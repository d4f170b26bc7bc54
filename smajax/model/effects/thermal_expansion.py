"""Thermal expansion of either sign, each phase with its own coefficient."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class ThermalExpansion(AbstractEffect):
    r"""$\varepsilon \mathrel{+}= [\xi \alpha_M + (1 - \xi) \alpha_A](T - T_\infty)$, on top of the base model's theta_T.

    A function of state, so that a closed cycle closes. The printed theta_T = +0.55 MPa/C is an expansion of
    -theta_T/E: -2e-5 (martensite) and -0.7e-5 1/C (austenite); the net coefficient is the sum of the two.
    """

    martensite: Scalar = parameter("1/K", -1.5e-4, 1.5e-4, "alpha_M beyond -theta_T/E_M")
    austenite: Scalar = parameter("1/K", -1.5e-4, 1.5e-4, "alpha_A beyond -theta_T/E_A")

    effect_name: ClassVar[str] = "thermal_expansion"
    title: ClassVar[str] = "thermal expansion of each phase"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = "strain += [xi alpha_M + (1 - xi) alpha_A] (T - T_inf), beyond theta_T of eq. 3.2"
    sentence: ClassVar[str] = (
        "A wire that is hot but no longer transforming changes length with its temperature: with a positive "
        "coefficient it creeps back while the power stays on and first contracts when the power is cut."
    )
    switches: ClassVar[tuple[str, ...]] = ("martensite", "austenite")
    starts: ClassVar[dict[str, float]] = {"martensite": 1e-5, "austenite": 1e-5}

    @classmethod
    def base(cls) -> ThermalExpansion:
        return cls(martensite=0.0, austenite=0.0)

    def strain(
        self, wire: Wire, temperature: Scalar, stress: Scalar, fraction: Scalar, detwinned: Scalar
    ) -> Scalar | float:
        coefficient = fraction * self.martensite + (1.0 - fraction) * self.austenite
        return coefficient * (temperature - wire.heat.ambient_temperature)
