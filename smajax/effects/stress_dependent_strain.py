"""Recoverable strain that grows with stress: a low stress orients only part of the martensite."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar

if TYPE_CHECKING:
    from smajax.wire.wire import Wire


class StressDependentStrain(AbstractEffect):
    r"""$\varepsilon_L(\sigma) = \varepsilon_L + g [1 - e^{-\sigma/\sigma_k}]$ (the form of Lagoudas et al. 2012, H^cur)."""

    # Not negative: a strain that falls with stress faster than the elastic one rises is no material.
    gain: Scalar = parameter("-", 0.0, 0.06, "g: recoverable strain added at high stress")
    scale: Scalar = parameter("Pa", 1e7, 6e8, "sigma_k: stress over which it grows")

    effect_name: ClassVar[str] = "stress_dependent_strain"
    title: ClassVar[str] = "recoverable strain depending on stress"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = "eps_L(sigma) = eps_L + g [1 - exp(-sigma/sigma_k)] (Lagoudas et al. 2012, H^cur)"
    sentence: ClassVar[str] = (
        "A higher stress orients more of the martensite, so the stroke between cold and hot is longer under a "
        "heavier load."
    )
    switches: ClassVar[tuple[str, ...]] = ("gain",)
    starts: ClassVar[dict[str, float]] = {"gain": 0.01, "scale": 1e8}

    @classmethod
    def base(cls) -> StressDependentStrain:
        return cls(gain=0.0, scale=1e8)

    def strain(
        self, wire: Wire, temperature: Scalar, stress: Scalar, fraction: Scalar, detwinned: Scalar
    ) -> Scalar | float:
        return self.gain * (1.0 - jnp.exp(-stress / self.scale)) * detwinned
