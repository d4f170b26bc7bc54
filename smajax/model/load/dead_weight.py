"""Hanging mass (eq. 3.13, 3.14); the mass may change in time."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.load.base import GRAVITY, AbstractMovingLoad
from smajax.model.types import Inputs, Scalar
from smajax.model.wire.wire import Wire


class DeadWeight(AbstractMovingLoad):
    r"""$m \ddot x + b \dot x + m g = F_w$ (Elahinia 2004, eq. 3.13)."""

    load_mass: Scalar = parameter("kg", 1e-4, 1e3, "hanging mass, where no input channel gives it")
    damping: Scalar = parameter("N s/m", 0.0, 1e4, "b: viscous friction of the guide")

    inputs_optional: ClassVar[frozenset[str]] = frozenset({"mass"})
    reading: ClassVar[tuple[str, str]] = ("position", "m")

    def _mass(self, inputs: Inputs) -> Scalar:
        return inputs.get("mass", self.load_mass)

    def start(self) -> Scalar:
        return jnp.zeros_like(self.load_mass)

    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        return -jnp.inf, jnp.inf

    def inertia(self, inputs: Inputs) -> Scalar:
        return self._mass(inputs)

    def resistance(self, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
        return self.damping * velocity + self._mass(inputs) * GRAVITY

    def lever(self) -> Scalar | float:
        return 1.0

    def contraction(self, wire: Wire) -> Scalar:
        return 1.0 / wire.wire_length
