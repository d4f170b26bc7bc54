"""Residual strain that builds up with cycles (shakedown)."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar, WireState
from smajax.wire.kept import TRANSFORMED, transformed


class ResidualStrain(AbstractEffect):
    r"""$\varepsilon \mathrel{+}= \varepsilon_r (1 - e^{-N/N_0})$, $N = \frac12 \int |d\xi|$ from the start of a run."""

    final: Scalar = parameter("-", 0.0, 0.05, "eps_r: residual strain after many cycles")
    cycles: Scalar = parameter("-", 0.5, 1e4, "N_0: cycles after which 63 % of it is there")

    effect_name: ClassVar[str] = "residual_strain"
    title: ClassVar[str] = "residual strain growing with cycles"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = (
        "strain += eps_r [1 - exp(-N/N_0)], N = (1/2) int |dxi| (usual form of transformation-induced plasticity)"
    )
    sentence: ClassVar[str] = (
        "The wire gets a little longer with every cycle and does not come back: it needs cycles under its load before "
        "its stroke is repeatable."
    )
    switches: ClassVar[tuple[str, ...]] = ("final",)
    starts: ClassVar[dict[str, float]] = {"final": 2e-3, "cycles": 5.0}

    @classmethod
    def base(cls) -> ResidualStrain:
        return cls(final=0.0, cycles=5.0)

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return {TRANSFORMED: jnp.zeros_like(stress)}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return transformed(old, fraction)

    def kept_strain(self, at: WireState) -> Scalar | float:
        return self.final * (1.0 - jnp.exp(-0.5 * at.kept[TRANSFORMED] / self.cycles))
