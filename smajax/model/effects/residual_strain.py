"""Residual strain that builds up with cycles (shakedown)."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import TRANSFORMED, transformed


class ResidualStrain(AbstractEffect):
    r"""$\varepsilon \mathrel{+}= \varepsilon_1 N_0 (1 - e^{-N/N_0})$, $N = \frac12 \int |d\xi|$ from the start of a run."""

    first: Scalar = parameter("-", 0.0, 0.02, "eps_1: residual strain of a cycle of the new wire")
    cycles: Scalar = parameter("-", 0.5, 1e4, "N_0: cycles after which a cycle leaves 37 % of that")

    effect_name: ClassVar[str] = "residual_strain"
    title: ClassVar[str] = "residual strain growing with cycles"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = (
        "strain += eps_1 N_0 [1 - exp(-N/N_0)], N = (1/2) int |dxi| (usual form of transformation-induced plasticity)"
    )
    sentence: ClassVar[str] = (
        "The wire gets a little longer with every cycle and does not come back: it needs cycles under its load before "
        "its stroke is repeatable."
    )
    switches: ClassVar[tuple[str, ...]] = ("first",)
    starts: ClassVar[dict[str, float]] = {"first": 4e-4, "cycles": 5.0}

    @classmethod
    def base(cls) -> ResidualStrain:
        return cls(first=0.0, cycles=5.0)

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return {TRANSFORMED: jnp.zeros_like(stress)}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return transformed(old, fraction)

    def kept_strain(self, at: WireState) -> Scalar | float:
        return self.first * self.cycles * (1.0 - jnp.exp(-0.5 * at.kept[TRANSFORMED] / self.cycles))
