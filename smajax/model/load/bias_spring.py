"""Slider on a bias spring: the wire contracts against a spring that stretches it again on cooling."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Inputs, Scalar
from smajax.model.wire.wire import Wire


class BiasSpring(AbstractMovingLoad):
    r"""$m \ddot x + b \dot x + F_0 + k x = A_w \sigma$, eq. 3.13 with a spring in the place of the weight."""

    slider_mass: Scalar = parameter("kg", 1e-4, 1e3, "mass of the slider")
    damping: Scalar = parameter("N s/m", 0.0, 1e4, "b: viscous friction of the guide")
    spring_stiffness: Scalar = parameter("N/m", 0.0, 1e6, "k: stiffness of the bias spring")
    spring_preload: Scalar = parameter("N", 1e-3, 1e4, "F_0: force of the spring at the start")

    reading: ClassVar[tuple[str, str]] = ("position", "m")

    def start(self) -> Scalar:
        return jnp.zeros_like(self.slider_mass)

    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        return -jnp.inf, jnp.inf

    def inertia(self, inputs: Inputs) -> Scalar:
        return self.slider_mass

    def resistance(self, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
        return self.damping * velocity + self.spring_preload + self.spring_stiffness * position

    def lever(self) -> Scalar | float:
        return 1.0

    def spring_rate(self) -> Scalar:
        return self.spring_stiffness

    def contraction(self, wire: Wire) -> Scalar:
        return 1.0 / wire.wire_length
