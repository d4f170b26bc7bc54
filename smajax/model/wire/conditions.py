"""When a branch of the kinetics may transform: the authors' conditions side by side (Elahinia 2004, Table 3.3)."""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.types import Scalar

# What warms by less than this in a step is at rest: else the rounding of a constant temperature had a direction.
REST = 1e-9  # C
ROUNDINGS = 1e3  # of a temperature of 1 C, where single precision makes that more


def _moves(change: Scalar) -> Bool[Array, ""]:
    """Whether a change of temperature (or of stress over its slope) is more than rest."""
    return change > max(REST, ROUNDINGS * float(jnp.finfo(change.dtype).eps))


class AbstractConditions(eqx.Module):
    """Directions in the stress-temperature plane; `warmer` (C) and `tighter` (Pa) are the changes over a step.

    `loaded` is true where the martensite present was formed by loading austenite, not by cooling it.
    """

    @abc.abstractmethod
    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar, loaded: Bool[Array, ""]) -> Bool[Array, ""]:
        """May martensite turn into austenite?"""

    @abc.abstractmethod
    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        """May austenite turn into martensite?"""


class Enhanced(AbstractConditions):
    r"""$\dot T - \dot\sigma / C_A > 0$ and $\dot T - \dot\sigma / C_M < 0$ (eq. 3.17, 3.18)."""

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar, loaded: Bool[Array, ""]) -> Bool[Array, ""]:
        return warmer - tighter / slope > 0.0

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return warmer - tighter / slope < 0.0


class Liang(AbstractConditions):
    r"""$\dot T > 0$ and $\dot T < 0$ (eq. 3.11)."""

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar, loaded: Bool[Array, ""]) -> Bool[Array, ""]:
        return _moves(warmer)

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return _moves(-warmer)


class Brinson(AbstractConditions):
    r"""Tanaka's and Brinson's: by heating as Liang's, and by unloading where loading had formed the martensite.

    Table 3.3 prints $\dot\sigma < 0$ and $\dot\sigma > 0$ alone, with which nothing transforms in a wire heated under a
    constant load. Eq. 2.14 and 2.15 are "for heating" and "for cooling" in the source's own reading (below eq. 2.15),
    and unloading (eq. 3.12) is said to need "stress-induced martensite [that] has been previously formed".
    """

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar, loaded: Bool[Array, ""]) -> Bool[Array, ""]:
        return _moves(warmer) | (_moves(-tighter / slope) & loaded)

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return _moves(-warmer) | _moves(tighter / slope)


class BrinsonAsPrinted(AbstractConditions):
    r"""$\dot\sigma < 0$ and $\dot\sigma > 0$ (Table 3.3, Tanaka and Brinson): isothermal loading only."""

    def heats(self, warmer: Scalar, tighter: Scalar, slope: Scalar, loaded: Bool[Array, ""]) -> Bool[Array, ""]:
        return _moves(-tighter / slope)

    def cools(self, warmer: Scalar, tighter: Scalar, slope: Scalar) -> Bool[Array, ""]:
        return _moves(tighter / slope)
