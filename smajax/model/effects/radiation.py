"""Radiation of the wire's surface."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatState, HeatTerm
from smajax.model.wire.wire import Wire

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m^2 K^4)
ZERO_CELSIUS = 273.15  # K


class Radiation(AbstractEffect, HeatTerm):
    r"""$e \sigma_{SB} A_c (T^4 - T_\infty^4)$ with absolute temperatures (Stefan-Boltzmann)."""

    emissivity: Scalar = parameter("-", 0.0, 1.0, "e: emissivity of the surface", default=0.0)

    effect_name: ClassVar[str] = "radiation"
    candidate: ClassVar[Candidate] = Candidate(
        title="radiation",
        equation="heat",
        formula="loss += e sigma_SB A_c (T^4 - T_inf^4), T absolute (Stefan-Boltzmann)",
        sentence="The surface radiates: a loss that grows faster than the temperature difference, small for thin wires "
        "in still air.",
        switches=("emissivity",),
        initial_guess={"emissivity": 0.3},
        prior_class="material",
        widths={
            "emissivity": Width(0.5, "emissivity of metals: 0.1 polished, 0.4 to 0.8 oxidised (Incropera and DeWitt)"),
        },
    )

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        surface = jnp.pi * wire.wire_diameter
        hot, cold = at.temperature + ZERO_CELSIUS, at.ambient + ZERO_CELSIUS
        return self.emissivity * STEFAN_BOLTZMANN * surface * (hot**4 - cold**4)
