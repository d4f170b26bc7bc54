"""What the kinetics remembers of the path: the amplitudes xi_M and xi_A of eq. 3.26, corrected and as printed."""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.types import Scalar, WireState

# Below this share a branch counts as finished: dividing by less would make the renewed amplitude pure rounding.
FINISHED = 1e-9


class AbstractRenewal(eqx.Module):
    """`h` and `k` are the shares of martensite and austenite that the two shapes leave at some temperature and stress."""

    @abc.abstractmethod
    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> tuple[Scalar, Scalar]:
        """(xi_M, xi_A) of a wire at rest at the fraction `xi`: 1 and 0 for cold martensite (sec. 3.7)."""

    @abc.abstractmethod
    def curves(self, old: WireState, h_old: Scalar, k_old: Scalar, h: Scalar, k: Scalar) -> tuple[Scalar, Scalar]:
        """xi on the heating and on the cooling curve that belong to `old`, where the shapes leave `h` and `k`."""

    @abc.abstractmethod
    def renewed(
        self,
        old: WireState,
        heating: Bool[Array, ""],
        cooling: Bool[Array, ""],
        h: Scalar,
        k: Scalar,
        xi: Scalar,
    ) -> tuple[Scalar, Scalar]:
        """(xi_M, xi_A) after a step on a branch that ended at the fraction `xi`."""


class Corrected(AbstractRenewal):
    """Renewed only while the other branch transforms, scaled so that the curve passes through the present state.

    Continuous at a reversal, complete at the end of the range, and blind to a pause. A curve that its conditions kept
    the wire from following (Liang's, when the stress falls faster than the temperature) is re-anchored at the present
    state too: the source integrates rates there and so does not jump.
    """

    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> tuple[Scalar, Scalar]:
        floor = 1.0 - (1.0 - xi) / jnp.maximum(k, FINISHED)
        return xi / jnp.maximum(h, FINISHED), jnp.where(xi >= 1.0, 0.0, floor)

    def curves(self, old: WireState, h_old: Scalar, k_old: Scalar, h: Scalar, k: Scalar) -> tuple[Scalar, Scalar]:
        return old.xi_M * h, 1.0 - (1.0 - old.xi_A) * k

    def renewed(
        self,
        old: WireState,
        heating: Bool[Array, ""],
        cooling: Bool[Array, ""],
        h: Scalar,
        k: Scalar,
        xi: Scalar,
    ) -> tuple[Scalar, Scalar]:
        missed_heating = ~heating & (old.xi_M * h < xi)
        missed_cooling = ~cooling & (1.0 - (1.0 - old.xi_A) * k > xi)
        xi_M = jnp.where(cooling | missed_heating, xi / jnp.maximum(h, FINISHED), old.xi_M)
        xi_A = jnp.where(heating | missed_cooling, 1.0 - (1.0 - xi) / jnp.maximum(k, FINISHED), old.xi_A)
        return xi_M, xi_A


class AsPrinted(AbstractRenewal):
    r"""Eq. 3.26 to the letter with the rates 3.4 and 3.6: $\xi_A = \xi$ while xi falls, $\xi_M = \xi$ whenever not.

    A pause in the middle of heating then shrinks the rest of the transformation, and so does every reversal inside a
    range: a resumed heating never reaches xi = 0 at A_f'.
    """

    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> tuple[Scalar, Scalar]:
        return xi, jnp.where(xi >= 1.0, 0.0, xi)

    def curves(self, old: WireState, h_old: Scalar, k_old: Scalar, h: Scalar, k: Scalar) -> tuple[Scalar, Scalar]:
        xi = old.martensite_fraction
        heated, cooled = xi + old.xi_M * (h - h_old), xi - (1.0 - old.xi_A) * (k - k_old)
        # The rule can ask for more than there is; here that ends the branch, with the stress still consistent.
        return jnp.where(heated > 0.0, heated, 0.0), jnp.where(cooled < 1.0, cooled, 1.0)

    def renewed(
        self,
        old: WireState,
        heating: Bool[Array, ""],
        cooling: Bool[Array, ""],
        h: Scalar,
        k: Scalar,
        xi: Scalar,
    ) -> tuple[Scalar, Scalar]:
        return jnp.where(heating, old.xi_M, xi), jnp.where(heating, xi, old.xi_A)
