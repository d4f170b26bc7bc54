"""What the kinetics remembers of the path: the amplitudes xi_M and xi_A of eq. 3.26, corrected and as printed."""

from __future__ import annotations

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.types import Scalar, WireState

# A share below this is none (`kinetics.martensite_left`): dividing by less would make an amplitude pure rounding.
FINISHED = 1e-9


# A curve that lies beyond the present fraction by less does not: where the wire rests on its curve, the rounding of the
# stress alone would count as a transformation, or as one missed, and renew an amplitude. In single precision a temperature of
# 80 C is known to 8e-6 C, and a curve that falls by 0.1 a degree to 7 roundings of 1; a rest of many more takes the onset of
# a transformation, which is as flat as a cosine, for none.
REST = 1e-10
ROUNDINGS = 8.0


def beyond(gap: Scalar) -> Bool[Array, ""]:
    """Whether a curve lies beyond the present fraction by more than rounding."""
    return gap > max(REST, ROUNDINGS * float(jnp.finfo(gap.dtype).eps))


# Of an amplitude that nobody knows: a wire that starts, or transforms the other way, beyond the end of a range (`behind`).
UNKNOWN = -1.0


def behind(share: Scalar, amount: Scalar) -> Bool[Array, ""]:
    """Whether the range that leaves `share` is over while there is an `amount` of the phase yet: no curve of it runs through the wire."""
    return (share <= FINISHED) & (amount > 0.0)


class Amplitudes(eqx.Module):
    """What a renewal carries from step to step."""

    xi_M: Scalar
    xi_A: Scalar
    heating_missed: Scalar  # xi_M of the curve that the wire is kept from, while it lies beyond, or `UNKNOWN`; else 0
    cooling_missed: Scalar  # 1 - xi_A, likewise


class AbstractRenewal(eqx.Module):
    """`h` and `k` are the shares of martensite and austenite that the two shapes leave at some temperature and stress."""

    @abc.abstractmethod
    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        """Of a wire at rest at the fraction `xi`: xi_M = 1 and xi_A = 0 for cold martensite (sec. 3.7)."""

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
    ) -> Amplitudes:
        """After a step on a branch that ended at the fraction `xi`."""

    @abc.abstractmethod
    def corrected(self, old: WireState, transforming: Bool[Array, ""], h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        """After an estimator has put the fraction to `xi`: the next step goes on from there, without a jump."""


class Corrected(AbstractRenewal):
    """Renewed only while the other branch transforms, scaled so that the curve passes through the present state.

    Continuous at a reversal, complete at the end of the range, and blind to a pause. Where the conditions keep the wire
    from following a curve (Liang's, when the stress falls faster than the temperature), or it starts beyond one, the
    curve is laid through the present state. So the fraction does not jump when it may follow again, and what was missed
    is made up for in what is left of the range: all of it, in a fraction of a degree, if hardly any is left. (The
    source's rates would lose it instead and never complete.) If the wire comes back before it may follow, the curve is
    the one of before: a vibration that takes the stress past the point where the wire turned back, and returns it,
    changes nothing, however far it went. (Where it follows in between, for however short, it begins anew from there.)
    """

    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        floor = 1.0 - (1.0 - xi) / jnp.maximum(k, FINISHED)
        return Amplitudes(
            xi / jnp.maximum(h, FINISHED),
            jnp.where(xi >= 1.0, 0.0, floor),
            jnp.where(behind(h, xi), UNKNOWN, 0.0),
            jnp.where(behind(k, 1.0 - xi), UNKNOWN, 0.0),
        )

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
    ) -> Amplitudes:
        top, floor = self._kept_from(old)
        held = ~heating & ~cooling
        beyond_heating = ~heating & beyond(xi - top * h)
        beyond_cooling = ~cooling & beyond(1.0 - (1.0 - floor) * k - xi)
        lost_heating = (held & (old.heating_missed < 0.0)) | (cooling & behind(h, xi))
        lost_cooling = (held & (old.cooling_missed < 0.0)) | (heating & behind(k, 1.0 - xi))
        laid_heating, laid_cooling = xi / jnp.maximum(h, FINISHED), 1.0 - (1.0 - xi) / jnp.maximum(k, FINISHED)
        kept_heating, kept_cooling = jnp.where(heating, old.xi_M, top), jnp.where(cooling, old.xi_A, floor)
        return Amplitudes(
            jnp.where(cooling | beyond_heating | lost_heating, laid_heating, kept_heating),
            jnp.where(heating | beyond_cooling | lost_cooling, laid_cooling, kept_cooling),
            jnp.where(lost_heating, UNKNOWN, jnp.where(held & beyond_heating, top, 0.0)),
            jnp.where(lost_cooling, UNKNOWN, jnp.where(held & beyond_cooling, 1.0 - floor, 0.0)),
        )

    def corrected(self, old: WireState, transforming: Bool[Array, ""], h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        laid = self.start(h, k, xi)
        # Off both branches a curve ahead of the wire is its memory of where it turned back: that one stays.
        heating = transforming | beyond(xi - old.xi_M * h)
        cooling = transforming | beyond(1.0 - (1.0 - old.xi_A) * k - xi)
        # Of a fraction that is put elsewhere, however little, the curve that the wire was kept from is not known.
        return Amplitudes(
            jnp.where(heating, laid.xi_M, old.xi_M),
            jnp.where(cooling, laid.xi_A, old.xi_A),
            jnp.where(old.heating_missed != 0.0, UNKNOWN, jnp.where(heating, laid.heating_missed, 0.0)),
            jnp.where(old.cooling_missed != 0.0, UNKNOWN, jnp.where(cooling, laid.cooling_missed, 0.0)),
        )

    @staticmethod
    def _kept_from(old: WireState) -> tuple[Scalar, Scalar]:
        """xi_M and xi_A of the curves that the wire would follow if the conditions had let it."""
        return (
            jnp.where(old.heating_missed > 0.0, old.heating_missed, old.xi_M),
            jnp.where(old.cooling_missed > 0.0, 1.0 - old.cooling_missed, old.xi_A),
        )


class AsPrinted(AbstractRenewal):
    r"""Eq. 3.26 to the letter with the rates 3.4 and 3.6: $\xi_A = \xi$ while xi falls, $\xi_M = \xi$ whenever not.

    A pause in the middle of heating then shrinks the rest of the transformation, and so does every reversal inside a
    range: a resumed heating never reaches xi = 0 at A_f'.
    """

    def start(self, h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        return Amplitudes(xi, jnp.where(xi >= 1.0, 0.0, xi), jnp.zeros_like(xi), jnp.zeros_like(xi))

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
    ) -> Amplitudes:
        never = jnp.zeros_like(xi)
        return Amplitudes(jnp.where(heating, old.xi_M, xi), jnp.where(heating, xi, old.xi_A), never, never)

    def corrected(self, old: WireState, transforming: Bool[Array, ""], h: Scalar, k: Scalar, xi: Scalar) -> Amplitudes:
        # These curves start from the present fraction, whatever it is.
        return Amplitudes(old.xi_M, old.xi_A, old.heating_missed, old.cooling_missed)
