"""The contract of a load that moves: what the wire has to overcome, as one equation of motion.

    inertia * a + resistance(position, velocity) = lever * A_w * stress,     strain = -contraction * (position - start)

Position is in metres, or radians for an arm, positive when the wire contracts. A coupon, whose temperature
and stress or strain are prescribed, has no equation of motion (`load/coupon.py`).
"""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

import equinox as eqx

from smajax.model.types import Inputs, Scalar
from smajax.model.wire.wire import Wire

GRAVITY = 9.81  # m/s^2


class AbstractMovingLoad(eqx.Module):
    """A mechanical load with one degree of freedom."""

    inputs_required: ClassVar[frozenset[str]] = frozenset()
    inputs_optional: ClassVar[frozenset[str]] = frozenset()
    reading: ClassVar[tuple[str, str]]  # what its sensor shows (`sensed`), and the SI unit
    # Of the load's preset: parameter -> where its number comes from, "printed: Table 3.1", "corrected: ..." or "chosen: ...".
    origins: ClassVar[Mapping[str, str]] = {}

    @abc.abstractmethod
    def start(self) -> Scalar:
        """Position at which the wire's strain is counted as zero."""

    @abc.abstractmethod
    def limits(self) -> tuple[Scalar | float, Scalar | float]:
        """End stops (inelastic), same unit as the position."""

    @abc.abstractmethod
    def inertia(self, inputs: Inputs) -> Scalar:
        """kg, or kg m^2 for an arm."""

    @abc.abstractmethod
    def resistance(self, position: Scalar, velocity: Scalar, inputs: Inputs) -> Scalar:
        """Force against +position: weight, springs, damping. N, or N m for an arm."""

    @abc.abstractmethod
    def lever(self) -> Scalar | float:
        """Force on +position per newton in the wire: 1, or 2 r (m) for an arm."""

    def spring_rate(self) -> Scalar | float:
        """Stiffness of its spring as the wire's moving end feels it, N/m; 0 without one."""
        return 0.0

    @abc.abstractmethod
    def contraction(self, wire: Wire) -> Scalar:
        """Strain lost per unit of position: 1/l_0, or 2 r / l_0 for an arm (eq. 3.7, 3.14)."""

    def sensed(self, position: Scalar) -> Scalar:
        """What its own sensor measures at a position, in the unit of `reading`: the position, where it does not say otherwise."""
        return position

    def travel(self, wire: Wire, strain: Scalar | float) -> Scalar:
        """How far it moves when the wire loses `strain`, m (rad for an arm): all of it, where the force hardly changes on the way."""
        return strain / self.contraction(wire)

    @property
    def position_unit(self) -> str:
        """SI."""
        return "rad" if self.reading[1] == "rad" else "m"
