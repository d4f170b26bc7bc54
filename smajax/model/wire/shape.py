"""How the transformation proceeds through its range: cosine (Liang, Brinson) or exponential (Tanaka)."""

from __future__ import annotations

import abc
import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.types import Scalar
from smajax.model.wire.branch_amplitude import FINISHED
from smajax.model.wire.cosine import quarter_cosine

# Tanaka's material constants are chosen so that 1 % is left at the far end of the range: A_a = ln(0.01)/(A_f - A_s).
LEFT_AT_THE_END = math.log(100.0)
COSINE_FINISHED = 1.0 - 2.0 / math.pi * math.asin(math.sqrt(FINISHED))  # where cos^2(pi z / 2) is `FINISHED`


class AbstractShape(eqx.Module):
    """Shares of the old phase left, at the reduced distance z through the range of a branch."""

    @abc.abstractmethod
    def martensite_left(self, z: Scalar) -> Scalar:
        """h(z), z = (y_A - A_s)/(A_f - A_s): 1 up to z = 0, falling after it."""

    def austenite_left(self, z: Scalar) -> Scalar:
        """k(z), z = (y_M - M_f)/(M_s - M_f): 1 from z = 1 on, falling as z falls. k(z) = h(1 - z) under every law."""
        return self.martensite_left(1.0 - z)

    def anything_left(self, z: Scalar) -> Bool[Array, ""]:
        """Whether more than `FINISHED` is left at z."""
        return self.martensite_left(z) > FINISHED

    @abc.abstractmethod
    def steepest(self) -> float:
        """Largest |dh/dz|, -."""


class Cosine(AbstractShape):
    r"""h = (1 + cos pi z)/2 and k = (1 - cos pi z)/2 for 0 <= z <= 1 (Elahinia 2004, eq. 3.3, 3.5 and 2.14, 2.15)."""

    def martensite_left(self, z: Scalar) -> Scalar:
        # Not `clip`: it asks at every end whether it is met exactly, and the slope there is zero anyway.
        within = jnp.where(z < 0.0, 0.0, jnp.where(z > 1.0, 1.0, z))
        return quarter_cosine(within) ** 2  # (1 + cos x)/2 = cos^2(x/2)

    def anything_left(self, z: Scalar) -> Bool[Array, ""]:
        return z < COSINE_FINISHED

    def steepest(self) -> float:
        return 0.5 * math.pi


class Exponential(AbstractShape):
    r"""$h = e^{-z \ln 100}$ for z >= 0 and $k = e^{-(1 - z) \ln 100}$ for z <= 1 (Elahinia 2004, eq. 2.3).

    With $A_a = \ln 0.01/(A_f - A_s)$, $A_m = \ln 0.01/(M_f - M_s)$ and $B = -A/C$. The transformation never quite ends,
    and it begins with a corner: the slope at z = 0 is the one from outside, zero.
    """

    def martensite_left(self, z: Scalar) -> Scalar:
        return jnp.exp(-LEFT_AT_THE_END * jnp.where(z > 0.0, z, 0.0))

    def steepest(self) -> float:
        return LEFT_AT_THE_END
