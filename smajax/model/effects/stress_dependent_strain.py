"""Recoverable strain that grows with stress: a low stress orients only part of the martensite."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.types import Scalar, WireState

BY_STRESS, AS_FORMED = "strain_by_stress", "strain_as_formed"


class StressDependentStrain(AbstractEffect):
    r"""$\varepsilon = b\,\varepsilon_f + (1 - b)\,\varepsilon_r$, $\dot\varepsilon_r = H\dot\xi$; $\dot\varepsilon_f = H\dot\xi$ forming, $\varepsilon_f\dot\xi/\xi$ going.

    $H = g [1 - e^{-\sigma/\sigma_k}]$. Martensite that is there keeps its strain when the stress changes. With b = 1 it
    gives back what it formed with (Lagoudas et al. 2012, forward and reverse transformation), with b = 0 what the stress
    of that moment asks for: eq. 3.2 in rate form with an eps_L that depends on stress, in which cycles that form under one
    stress and go under another leave strain behind. Under a constant stress the two are one. A run begins with what its
    first stress orients.
    """

    # Not negative: a strain that falls with stress faster than the elastic one rises is no material.
    gain: Scalar = parameter("-", 0.0, 0.06, "g: recoverable strain added at high stress")
    scale: Scalar = parameter("Pa", 1e7, 6e8, "sigma_k: stress over which it grows")

    returned: Scalar = parameter("-", 0.0, 1.0, "b: 1 where martensite gives back the strain it formed with")

    effect_name: ClassVar[str] = "stress_dependent_strain"
    title: ClassVar[str] = "recoverable strain depending on stress"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = (
        "eps_L(sigma) = eps_L + g [1 - exp(-sigma/sigma_k)] per fraction that forms or goes; the share b of it goes as it "
        "formed (Lagoudas et al. 2012, H^cur)"
    )
    sentence: ClassVar[str] = (
        "A higher stress orients more of the martensite, so the stroke between cold and hot is longer under a "
        "heavier load."
    )
    switches: ClassVar[tuple[str, ...]] = ("gain",)
    starts: ClassVar[dict[str, float]] = {"gain": 0.01, "scale": 1e8, "returned": 0.5}

    @classmethod
    def base(cls) -> StressDependentStrain:
        return cls(gain=0.0, scale=1e8, returned=0.5)

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        # A little inside: at its bound a share has one side only.
        return ({"returned": 0.05}, {"returned": 0.95})

    def _of(self, stress: Scalar) -> Scalar:
        # A solver may try a negative stress, of which the exponential knows no end.
        return self.gain * (1.0 - jnp.exp(-jnp.where(stress < 0.0, 0.0, stress) / self.scale))

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        begun = self._of(stress) * fraction
        return {BY_STRESS: begun, AS_FORMED: begun}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        before, formed = old.martensite_fraction, old.kept[AS_FORMED]
        change = fraction - before
        asked = 0.5 * (self._of(old.stress) + self._of(stress)) * change
        given_back = formed * change / jnp.where(before > 0.0, before, 1.0)
        return {
            BY_STRESS: old.kept[BY_STRESS] + asked,
            AS_FORMED: formed + jnp.where(change < 0.0, given_back, asked),
        }

    def kept_strain(self, at: WireState) -> Scalar | float:
        return self.returned * at.kept[AS_FORMED] + (1.0 - self.returned) * at.kept[BY_STRESS]
