"""Retarded elasticity: one Kelvin element in series with the wire, so it creeps and relaxes."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar, WireState
from smajax.wire.kept import DURATION, following

LAGGING = "lagging_stress"


class Creep(AbstractEffect):
    r"""$\varepsilon \mathrel{+}= J \sigma_v$ with $\tau \dot\sigma_v + \sigma_v = \sigma$ (Kelvin); at the start $\sigma_v = \sigma$.

    Under a held stress the strain creeps on by J times the last change of stress; under a held strain the stress relaxes.
    """

    compliance: Scalar = parameter("1/Pa", 0.0, 1e-10, "J: retarded strain per stress; 1/E is 1.3e-11 to 3.6e-11")
    time_constant: Scalar = parameter("s", 0.1, 1e4, "tau: retardation time")

    effect_name: ClassVar[str] = "creep"
    title: ClassVar[str] = "creep and relaxation"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = "strain += J sigma_v, tau dsigma_v/dt + sigma_v = sigma (Kelvin element in series)"
    sentence: ClassVar[str] = (
        "After a change of load the wire goes on stretching (or shortening) for a while although neither load nor "
        "temperature changes."
    )
    switches: ClassVar[tuple[str, ...]] = ("compliance",)
    starts: ClassVar[dict[str, float]] = {"compliance": 5e-12, "time_constant": 5.0}

    @classmethod
    def base(cls) -> Creep:
        return cls(compliance=0.0, time_constant=5.0)

    def kept_at_start(self, temperature: Scalar, stress: Scalar) -> dict[str, Scalar]:
        return {LAGGING: stress, DURATION: jnp.zeros_like(stress)}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return {LAGGING: following(old, LAGGING, stress, self.time_constant)}

    def kept_strain(self, at: WireState) -> Scalar | float:
        return self.compliance * at.kept[LAGGING]
