"""How much of the martensite is detwinned, that is, gives strain: all of it, or Brinson's xi_s of xi = xi_s + xi_T."""

from __future__ import annotations

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.types import Scalar, WireState
from smajax.model.wire.cosine import quarter_cosine

# A fraction of martensite below this is none: its detwinned share means nothing.
NONE_LEFT = 1e-12


class AbstractVariants(eqx.Module):
    """The detwinned (stress-induced) part of the martensite."""

    detwins: ClassVar[bool]  # whether a stress alone changes it

    @abc.abstractmethod
    def detwinned_at_start(self, stress: Scalar, fraction: Scalar) -> Scalar:
        """xi_s of a wire at rest."""

    @abc.abstractmethod
    def detwinned(self, old: WireState, stress: Scalar, fraction: Scalar) -> Scalar:
        """xi_s after a step from `old` to (`stress`, `fraction`)."""


class Single(AbstractVariants):
    """All martensite is detwinned, as under a permanent bias stress: xi_s = xi (Tanaka, Liang, the enhanced model)."""

    detwins: ClassVar[bool] = False

    def detwinned_at_start(self, stress: Scalar, fraction: Scalar) -> Scalar:
        return fraction

    def detwinned(self, old: WireState, stress: Scalar, fraction: Scalar) -> Scalar:
        return fraction


class Split(AbstractVariants):
    r"""Brinson's split (Elahinia 2004, eq. 2.16, 2.17), with detwinning between two critical stresses.

    A stress sigma detwins the share $d = (1 - \cos[\pi (\sigma - \sigma_s^{cr})/(\sigma_f^{cr} - \sigma_s^{cr})])/2$ of
    the martensite, and of what forms under it. Unloading does not twin it again; austenite takes from both parts in
    proportion. The source names the split and leaves its equations out; Brinson (1993) lets detwinning begin at
    sigma_s^cr again in every cycle, here it goes on where the largest stress so far had left it.
    """

    detwins: ClassVar[bool] = True

    critical_stress_start: Scalar = parameter("Pa", 0.0, 1e9, "sigma_s^cr: detwinning begins")
    critical_stress_finish: Scalar = parameter("Pa", 1e5, 1e9, "sigma_f^cr: detwinning is complete")

    def share(self, stress: Scalar) -> Scalar:
        """d(stress), -."""
        width = jnp.maximum(self.critical_stress_finish - self.critical_stress_start, 1.0)
        z = jnp.clip((stress - self.critical_stress_start) / width, 0.0, 1.0)
        return 1.0 - quarter_cosine(z) ** 2

    def detwinned_at_start(self, stress: Scalar, fraction: Scalar) -> Scalar:
        return self.share(stress) * fraction

    def detwinned(self, old: WireState, stress: Scalar, fraction: Scalar) -> Scalar:
        share, before = self.share(stress), old.martensite_fraction
        shrunk = old.detwinned_fraction * fraction / jnp.maximum(before, NONE_LEFT)
        grown = old.detwinned_fraction + share * (fraction - before)
        return jnp.maximum(jnp.where(fraction > before, grown, shrunk), share * fraction)
