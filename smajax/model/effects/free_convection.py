"""Free convection by a power law: the exponent of the correlations for a horizontal wire."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import CONVECTION_OF_TEMPERATURE, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatState, HeatTerm, convection
from smajax.model.wire.wire import Wire

REFERENCE = 50.0  # K over the air, where h is h_c: about the middle of what a wire goes through
SLIGHTEST = 1.0  # K: nearer to the air's temperature the law is that of conduction, and h is constant


class FreeConvection(AbstractEffect, HeatTerm):
    r"""$h = h_c (\theta/\theta_r)^n$ with $\theta^2 = (T - T_\infty)^2 + \theta_0^2$, $\theta_r$ 50 K and $\theta_0$ 1 K.

    $Nu = C\,Ra^n$ (Morgan, in Incropera and DeWitt, eq. 9.33), with $Ra$ in proportion to the temperature over the air's.
    """

    exponent: Scalar = parameter("-", -0.2, 0.6, "n: exponent of the temperature over the air's", default=0.0)

    effect_name: ClassVar[str] = "free_convection"
    candidate: ClassVar[Candidate] = Candidate(
        title="free convection by a power law",
        equation="heat",
        formula="h = h_c [(T - T_inf)/50 K]^n in eq. 3.1 (Nu = C Ra^n; Morgan, in Incropera and DeWitt)",
        sentence="The air that the wire heats rises and cools it, at first strongly and then ever less: one constant h_c cools too "
        "little when hot and too much when nearly cold.",
        negative_sentence="The hotter the wire, the less well the air takes its heat away: one constant h_c cools too much when hot "
        "and too little when nearly cold.",
        switches=("exponent",),
        initial_guess={"exponent": 0.1},
        prior_class="material",
        similar_group=CONVECTION_OF_TEMPERATURE,
        widths={
            "exponent": Width(0.15, "0.06 to 0.25 of horizontal wires (Morgan, in Incropera and DeWitt)"),
        },
    )

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        over = at.temperature - at.ambient
        # Of the logarithm, so that it is smooth in n at zero, where nothing is added.
        ratio = 0.5 * jnp.log((over**2 + SLIGHTEST**2) / REFERENCE**2)
        return convection(wire, at.temperature, at.ambient) * jnp.expm1(self.exponent * ratio)
