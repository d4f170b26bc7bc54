"""E and Omega of the constitutive law: mixed by the fraction (eq. 3.15), or constant as sec. 3.3 takes them."""

from __future__ import annotations

import abc

import equinox as eqx

from smajax.model.types import Scalar


class AbstractStiffness(eqx.Module):
    """E(xi), Pa, and -Omega/E, the strain of one unit of fraction."""

    @abc.abstractmethod
    def young_modulus(self, austenite: Scalar, martensite: Scalar, fraction: Scalar) -> Scalar:
        """E, Pa."""

    @abc.abstractmethod
    def transformation_strain(
        self, austenite: Scalar, martensite: Scalar, recoverable: Scalar, fraction: Scalar
    ) -> Scalar:
        """-Omega/E, -."""


class Mixed(AbstractStiffness):
    r"""$E = E_A + \xi (E_M - E_A)$ and $\Omega = -E(\xi) \varepsilon_L$ (eq. 3.15, below eq. 3.2)."""

    def young_modulus(self, austenite: Scalar, martensite: Scalar, fraction: Scalar) -> Scalar:
        return austenite + fraction * (martensite - austenite)

    def transformation_strain(
        self, austenite: Scalar, martensite: Scalar, recoverable: Scalar, fraction: Scalar
    ) -> Scalar:
        return recoverable


class MixedConstantOmega(AbstractStiffness):
    r"""E(xi) of eq. 3.15 with the printed constant $\Omega = -E_M \varepsilon_L$ (Table 3.1: -1.12 GPa)."""

    def young_modulus(self, austenite: Scalar, martensite: Scalar, fraction: Scalar) -> Scalar:
        return austenite + fraction * (martensite - austenite)

    def transformation_strain(
        self, austenite: Scalar, martensite: Scalar, recoverable: Scalar, fraction: Scalar
    ) -> Scalar:
        return recoverable * martensite / self.young_modulus(austenite, martensite, fraction)


class Constant(AbstractStiffness):
    r"""$E = E_M$ and $\Omega = -E_M \varepsilon_L$: "the modulus [and] transformational tensor ... constant" (sec. 3.3)."""

    def young_modulus(self, austenite: Scalar, martensite: Scalar, fraction: Scalar) -> Scalar:
        return martensite + 0.0 * fraction

    def transformation_strain(
        self, austenite: Scalar, martensite: Scalar, recoverable: Scalar, fraction: Scalar
    ) -> Scalar:
        return recoverable
