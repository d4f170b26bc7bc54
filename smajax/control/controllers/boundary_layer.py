r"""The voltage of a variable structure controller from its surface: V_high far below it, V_low far above it, and between.

Inside the layer the source prints $u = K s$ (Elahinia 2004, eq. 4.5, 4.34). With K > 0 that heats beyond the set point
and cools short of it, and with any K it jumps at an edge of the layer, because V_high and V_low are not opposite.
What meets both edges is one straight line,

    u = (V_high + V_low)/2 + K s,      K = -(V_high - V_low)/(2 phi),

so K is no free gain. It is the default; the printed form is `AsPrinted`.
"""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp

from smajax.core.limited import limited
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class AbstractLayer(eqx.Module):
    """What happens inside of the layer."""

    @abc.abstractmethod
    def voltage(self, surface: Scalar, boundary: Scalar, high: Scalar, low: Scalar) -> Scalar:
        """V from the surface s and the layer's half thickness phi (same unit), V_high and V_low."""


class Continuous(AbstractLayer):
    """The line from (-phi, V_high) to (phi, V_low)."""

    def voltage(self, surface: Scalar, boundary: Scalar, high: Scalar, low: Scalar) -> Scalar:
        return 0.5 * (high + low) - 0.5 * (high - low) * limited(surface / boundary, -1.0, 1.0)


class AsPrinted(AbstractLayer):
    """K s, held between 0 and V_high: a voltage below zero would heat as well. It jumps where it meets the edges."""

    layer_gain: Scalar = parameter("V per unit of s", -1e6, 1e6, "K: below zero, or it heats beyond the set point")

    def voltage(self, surface: Scalar, boundary: Scalar, high: Scalar, low: Scalar) -> Scalar:
        inside = limited(self.layer_gain * surface, 0.0, high)
        inside = inside + 0.0 * boundary  # nan in, nan out: a comparison alone would hide it
        return jnp.where(surface < -boundary, high, jnp.where(surface > boundary, low, inside))
