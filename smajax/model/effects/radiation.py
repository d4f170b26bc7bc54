"""Radiation of the wire's surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m^2 K^4)
ZERO_CELSIUS = 273.15  # K


class Radiation(AbstractEffect):
    r"""$e \sigma_{SB} A_c (T^4 - T_\infty^4)$ with absolute temperatures (Stefan-Boltzmann)."""

    emissivity: Scalar = parameter("-", 0.0, 1.0, "e: emissivity of the surface")

    effect_name: ClassVar[str] = "radiation"
    title: ClassVar[str] = "radiation"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = "loss += e sigma_SB A_c (T^4 - T_inf^4), T absolute (Stefan-Boltzmann)"
    sentence: ClassVar[str] = (
        "The surface radiates: a loss that grows faster than the temperature difference, small for thin wires "
        "in still air."
    )
    switches: ClassVar[tuple[str, ...]] = ("emissivity",)
    starts: ClassVar[dict[str, float]] = {"emissivity": 0.3}

    @classmethod
    def base(cls) -> Radiation:
        return cls(emissivity=0.0)

    def heat_loss(self, wire: Wire, temperature: Scalar, ambient: Scalar) -> Scalar | float:
        surface = jnp.pi * wire.wire_diameter
        hot, cold = temperature + ZERO_CELSIUS, ambient + ZERO_CELSIUS
        return self.emissivity * STEFAN_BOLTZMANN * surface * (hot**4 - cold**4)
