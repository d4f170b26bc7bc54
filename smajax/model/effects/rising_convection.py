"""Convection that rises with temperature: a hot wire stirs its own air."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class RisingConvection(AbstractEffect):
    r"""$h = h_c [1 + a (T - T_\infty)]$, the first term of the free-convection laws in Elahinia 2004, appendix A."""

    # Above -1/400 per degree h stays positive for every wire below 400 C over ambient.
    slope: Scalar = parameter("1/K", -2e-3, 0.05, "a: relative rise of h_c per degree above ambient")

    effect_name: ClassVar[str] = "rising_convection"
    title: ClassVar[str] = "convection rising with temperature"
    equation: ClassVar[str] = "heat"
    formula: ClassVar[str] = "h = h_c [1 + a (T - T_inf)] in eq. 3.1 (free convection; Elahinia 2004, appendix A)"
    sentence: ClassVar[str] = (
        "The hotter the wire, the better the air takes its heat away: one constant h_c cools too little when hot "
        "and too much when nearly cold."
    )
    switches: ClassVar[tuple[str, ...]] = ("slope",)
    starts: ClassVar[dict[str, float]] = {"slope": 2e-3}

    @classmethod
    def base(cls) -> RisingConvection:
        return cls(slope=0.0)

    def heat_loss(self, wire: Wire, temperature: Scalar, ambient: Scalar) -> Scalar | float:
        surface = jnp.pi * wire.wire_diameter
        return wire.heat.convection_coefficient * surface * self.slope * (temperature - ambient) ** 2
