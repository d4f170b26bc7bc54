"""A wire clamped between a frame and a load cell: it can hardly move, and its sensor shows a force."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Inputs, Scalar
from smajax.model.wire.heat import cross_section
from smajax.model.wire.wire import Wire


class BlockedWire(AbstractMovingLoad):
    r"""$m \ddot x + b \dot x + F_0 + K x = A_w \sigma$, eq. 3.13 with a load cell in the place of the weight; the reading is $F_0 + K x$.

    x is the deflection of load cell, frame and clamps together, and K their stiffness in series. At rest after a full transformation
    of the strain eps the force has risen by K L eps/(1 + K L/(E A_w)): an infinite K cannot be had, and is not needed. At the upper
    bound of 1e7 N/m a wire of 0.15 mm and 0.5 m is within 0.03 % of the force of a rigid frame, one of 0.5 mm and 0.1 m within 1.5 %.
    What a load cell deflects by is linear, so there is no `spring_rate` that could stiffen.
    """

    cell_stiffness: Scalar = parameter("N/m", 1e2, 1e7, "K: stiffness of load cell, frame and clamps in series")
    pretension: Scalar = parameter("N", 1e-3, 1e4, "F_0: force in the wire at the start")
    fixture_mass: Scalar = parameter("kg", 1e-4, 1e3, "mass of what moves with the wire's end")
    damping: Scalar = parameter("N s/m", 0.0, 1e4, "b: viscous damping of the load cell")

    reading: ClassVar[tuple[str, str]] = ("force", "N")
    origins: ClassVar[dict[str, str]] = {
        "cell_stiffness": "chosen: a load cell of 50 N that gives way by 0.5 mm, its frame and clamps included",
        "pretension": "chosen: 113 MPa in a wire of 0.15 mm",
        "fixture_mass": "chosen: too small to matter",
        "damping": "chosen: above the critical damping of 21 N s/m; the load cell follows within 1 ms",
    }

    def start(self) -> Scalar:
        return jnp.zeros_like(self.cell_stiffness)

    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        return -jnp.inf, jnp.inf

    def inertia(self, inputs: Inputs) -> Scalar:
        return self.fixture_mass

    def resistance(self, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
        return self.damping * velocity + self.sensed(position)

    def lever(self) -> Scalar | float:
        return 1.0

    def contraction(self, wire: Wire) -> Scalar:
        return 1.0 / wire.wire_length

    def sensed(self, position: Scalar) -> Scalar:
        return self.pretension + self.cell_stiffness * position

    def travel(self, wire: Wire, strain: Scalar | float) -> Scalar:
        stretched = self.cell_stiffness * wire.wire_length / cross_section(wire)
        return strain * wire.wire_length / (1.0 + stretched / wire.constitutive.young_modulus_austenite)


def blocked_wire() -> BlockedWire:
    """A load cell of 50 N, and a pretension of 2 N; heavily damped, so that it follows within a millisecond."""
    return BlockedWire(cell_stiffness=1e5, pretension=2.0, fixture_mass=1e-3, damping=50.0)
