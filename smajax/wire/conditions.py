"""When a branch of the kinetics may transform: the authors' conditions side by side (Elahinia 2004, Table 3.3)."""

from __future__ import annotations

import abc

import equinox as eqx
from jaxtyping import Array, Bool

from smajax.types import Scalar


class AbstractConditions(eqx.Module):
    """Directions in the stress-temperature plane; `warmer` (C) and `tighter` (Pa) are the changes over a step."""

    @abc.abstractmethod
    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        """May martensite turn into austenite?"""

    @abc.abstractmethod
    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        """May austenite turn into martensite?"""


class Enhanced(AbstractConditions):
    r"""$\dot T - \dot\sigma / C_A > 0$ and $\dot T - \dot\sigma / C_M < 0$ (eq. 3.17, 3.18)."""

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return warmer - tighter / slope > 0.0

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return warmer - tighter / slope < 0.0


class Liang(AbstractConditions):
    r"""$\dot T > 0$ and $\dot T < 0$ (eq. 3.11)."""

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return warmer > 0.0

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return warmer < 0.0
