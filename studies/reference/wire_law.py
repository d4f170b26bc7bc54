"""Transformation curves of the named laws, both branches in one form.

A branch (+1 heating, -1 cooling) has a progress u, 0 at the start of its range and 1 at the end: u = z_A when heating,
1 - z_M when cooling. What it has yet to transform, m = xi when heating and 1 - xi when cooling, is amplitude * curve(u)
with amplitude xi_M when heating, 1 - xi_A when cooling. Stress in Pa, temperature in degrees Celsius.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.reference.wire_parameters import WireParameters


@dataclass(frozen=True)
class Law:
    """Shape of the curves, conditions under which they are followed, and whether martensite is split in two."""

    exponential: bool
    conditions: str
    split: bool

    def curve(self, u: float) -> float:
        """Share not yet transformed at progress u."""
        if self.exponential:
            return 100.0 ** -max(u, 0.0)
        return (1 + math.cos(math.pi * min(max(u, 0.0), 1.0))) / 2

    def slope(self, u: float) -> float:
        """Derivative of `curve`, from the right at u = 0."""
        if self.exponential:
            return -math.log(100) * 100.0**-u if u >= 0 else 0.0
        return -math.pi / 2 * math.sin(math.pi * min(max(u, 0.0), 1.0))

    def progress(self, share: float) -> float:
        """Where `curve` is `share`, for shares in (0, 1]."""
        return -math.log(share) / math.log(100) if self.exponential else math.acos(2 * share - 1) / math.pi


LAWS = {
    "tanaka": Law(exponential=True, conditions="brinson", split=False),
    "liang": Law(exponential=False, conditions="liang", split=False),
    "brinson": Law(exponential=False, conditions="brinson", split=True),
    "enhanced": Law(exponential=False, conditions="enhanced", split=False),
}


@dataclass
class Branch:
    """One branch with what it carries: m = offset + amplitude * curve(u), followed from u = contact on."""

    sign: int
    start: float
    span: float
    slope: float
    amplitude: float = 1.0
    offset: float = 0.0  # not zero only where the printed renewal keeps the curve from passing through the state
    contact: float = math.inf
    beyond: bool = False  # u is past the contact, yet the branch is not followed

    def progress(self, s: Sequence[float] | NDArray[np.float64]) -> float:
        """Progress u, of a state that begins with temperature and stress."""
        return self.sign * (float(s[0]) - float(s[1]) / self.slope - self.start) / self.span

    def pace(self, temperature_rate: float, stress_rate: float) -> float:
        """Rate of y, counted positive where u rises, K/s."""
        return self.sign * (temperature_rate - stress_rate / self.slope)

    def left(self, xi: float) -> float:
        """What the branch has yet to transform, m; its own inverse: xi from m."""
        return xi if self.sign > 0 else 1 - xi


def branches(wire: WireParameters) -> tuple[Branch, Branch]:
    """The heating and the cooling branch."""
    w = wire
    return (
        Branch(1, w.austenite_start, w.austenite_finish - w.austenite_start, w.austenite_slope),
        Branch(-1, w.martensite_start, w.martensite_start - w.martensite_finish, w.martensite_slope),
    )


def detwinned_share(wire: WireParameters, stress: float) -> tuple[float, float]:
    """Least detwinned share d of the martensite at a stress, and its derivative, 1/Pa."""
    span = wire.detwinning_finish - wire.detwinning_start
    u = math.pi * min(max((stress - wire.detwinning_start) / span, 0.0), 1.0)
    return (1 - math.cos(u)) / 2, math.pi / (2 * span) * math.sin(u)
