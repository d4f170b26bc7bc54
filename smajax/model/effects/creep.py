"""Retarded elasticity: one Kelvin element in series with the wire, so it creeps and relaxes."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, Extent
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import DURATION, following

RETARDED = "retarded_strain"


class Creep(AbstractEffect):
    r"""$\varepsilon \mathrel{+}= \varepsilon_v$ with $\tau \dot\varepsilon_v + \varepsilon_v = [J_A + (J_M - J_A) \xi] \sigma$ (Kelvin).

    Under a held stress the strain creeps on after a change of stress or of phase: martensite, the softer phase, creeps
    more. Under a held strain the stress relaxes. A run begins at rest.
    """

    austenite: Scalar = parameter("1/Pa", 0.0, 5e-10, "J_A: retarded strain per stress; 1/E is 1.3e-11 to 3.6e-11")
    martensite: Scalar = parameter("1/Pa", 0.0, 5e-10, "J_M")
    time_constant: Scalar = parameter("s", 0.1, 1e4, "tau: retardation time")

    effect_name: ClassVar[str] = "creep"
    title: ClassVar[str] = "creep and relaxation"
    equation: ClassVar[str] = "constitutive"
    formula: ClassVar[str] = (
        "strain += eps_v, tau deps_v/dt + eps_v = [J_A + (J_M - J_A) xi] sigma (Kelvin element in series)"
    )
    sentence: ClassVar[str] = (
        "After a change of load or of phase the wire goes on stretching (or shortening) for a while although neither load "
        "nor temperature changes any more."
    )
    switches: ClassVar[tuple[str, ...]] = ("austenite", "martensite")
    needs_time: ClassVar[bool] = True
    starts: ClassVar[dict[str, float]] = {"austenite": 5e-12, "martensite": 5e-12, "time_constant": 5.0}

    @classmethod
    def base(cls) -> Creep:
        return cls(austenite=0.0, martensite=0.0, time_constant=5.0)

    @classmethod
    def places(cls, extent: Extent) -> tuple[dict[str, float], ...]:
        return tuple({"time_constant": share * extent.seconds} for share in (0.01, 0.05, 0.2))

    def _settled(self, stress: Scalar, fraction: Scalar) -> Scalar:
        return (self.austenite + (self.martensite - self.austenite) * fraction) * stress

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return {RETARDED: self._settled(stress, fraction), DURATION: jnp.zeros_like(stress)}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        before, now = self._settled(old.stress, old.martensite_fraction), self._settled(stress, fraction)
        return {RETARDED: following(old, RETARDED, before, now, self.time_constant)}

    def kept_strain(self, at: WireState) -> Scalar | float:
        return at.kept[RETARDED]
