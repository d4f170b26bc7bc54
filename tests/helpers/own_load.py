"""Loads of a user's own: a lever with a stiffening spring, one that turns, and one that asks for an input."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.load.base import GRAVITY, AbstractMovingLoad
from smajax.model.types import Scalar


class Lever(AbstractMovingLoad):
    """A user's own load: the wire pulls at one end of a lever, a stiffening spring at the other."""

    mass: Scalar = parameter("kg", 1e-4, 1e2, "at the long end", default=0.05)
    ratio: Scalar = parameter("-", 0.1, 10.0, "way of the mass per way of the wire", default=2.0)
    preload: Scalar = parameter("N", 0.0, 1e2, "of the spring", default=0.5)
    stiffness: Scalar = parameter("N/m", 0.0, 1e4, "of the spring at the start", default=10.0)
    stiffening: Scalar = parameter("N/m^3", 0.0, 1e9, "of the spring", default=2e3)
    guide: Scalar = parameter("N s/m", 0.0, 1e3, "friction", default=10.0)
    reading: ClassVar[tuple[str, str]] = ("position", "m")

    def start(self) -> Scalar:
        return jnp.zeros_like(self.mass)

    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        return -jnp.inf, jnp.inf

    def inertia(self, inputs):
        return self.mass

    def resistance(self, position, velocity, inputs):
        spring = self.preload + self.stiffness * position + self.stiffening * position**3
        return spring + self.guide * velocity

    def lever(self):
        return 1.0 / self.ratio

    def contraction(self, wire):
        return 1.0 / (self.ratio * wire.wire_length)


class Crank(Lever):
    """The same on a drum of 20 mm, read as an angle."""

    reading: ClassVar[tuple[str, str]] = ("angle", "rad")

    def lever(self):
        return 0.02

    def contraction(self, wire):
        return 0.02 / wire.wire_length


class Scheduled(Lever):
    """Its resistance follows an input, which no controller is told."""

    inputs_required: ClassVar[frozenset[str]] = frozenset({"mass"})

    def resistance(self, position, velocity, inputs):
        return inputs["mass"] * GRAVITY + self.guide * velocity
