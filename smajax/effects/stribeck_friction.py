"""Friction that is larger at rest than in motion."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar


class StribeckFriction(AbstractEffect):
    r"""$F_s e^{-(v/v_s)^2}\,\mathrm{sign}(v)$: what breaking away takes beyond Coulomb's friction (Stribeck curve, Gaussian form).

    Built up over the same presliding displacement as `CoulombFriction`.
    """

    excess: Scalar = parameter("N", 0.0, 5.0, "F_s: friction at rest beyond that in motion (N m on an arm)")
    speed: Scalar = parameter("m/s", 1e-5, 1.0, "v_s: speed of the wire's moving end at which the excess has gone")

    effect_name: ClassVar[str] = "stribeck_friction"
    title: ClassVar[str] = "Stribeck friction"
    equation: ClassVar[str] = "mechanics"
    formula: ClassVar[str] = (
        "friction += F_s exp[-(v/v_s)^2] sign(v) in eq. 3.8, 3.13 (Stribeck curve, usual Gaussian form)"
    )
    sentence: ClassVar[str] = (
        "Breaking away takes more force than keeping in motion: the load jumps when it starts, and may go on in jerks."
    )
    switches: ClassVar[tuple[str, ...]] = ("excess",)
    starts: ClassVar[dict[str, float]] = {"excess": 0.05, "speed": 0.01}

    @classmethod
    def base(cls) -> StribeckFriction:
        return cls(excess=0.0, speed=0.01)

    def friction_limit(self, speed: Scalar) -> Scalar | float:
        return self.excess * jnp.exp(-((speed / self.speed) ** 2))
