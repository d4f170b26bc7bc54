"""The form in which eq. 3.2 is integrated: in rates (eq. 3.2), or as a function of state (eq. 4.51)."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx

from smajax.model.types import Scalar, WireState


class Elasticity(NamedTuple):
    """The constitutive law of one wire with what effects change, as a form needs it."""

    modulus: Callable[[Scalar], Scalar]  # E at a martensite fraction, Pa
    transformation_strain: Callable[[Scalar], Scalar]  # -Omega/E at a martensite fraction, -
    effect_strain: Callable[[WireState], Scalar | float]  # that effects add, a function of state, -
    thermal_modulus: Scalar  # theta_T, Pa/K
    ambient_temperature: Scalar  # T_inf, C


class AbstractForm(eqx.Module):
    """How eq. 3.2 is carried from one state to the next."""

    @abc.abstractmethod
    def elastic_line(self, law: Elasticity, old: WireState, new: WireState) -> tuple[Scalar, Scalar, Scalar]:
        """(strain, stress at it, modulus): a point of the straight line of stress over strain at `new`, and its slope.

        The stress and strain of `new` itself are guesses.
        """


class RateForm(AbstractForm):
    r"""Eq. 3.2, $\dot\sigma = E \dot\varepsilon + \theta_T \dot T + \Omega \dot\xi_s$, over one step with E at the middle fraction.

    With E(xi) this is not the derivative of any sigma(strain, T, xi): a cycle that transforms at one stress and returns
    at another does not close. With a constant E it is, and agrees with the integrated form.
    """

    def elastic_line(self, law: Elasticity, old: WireState, new: WireState) -> tuple[Scalar, Scalar, Scalar]:
        middle = 0.5 * (old.martensite_fraction + new.martensite_fraction)
        grown = law.transformation_strain(middle) * (new.detwinned_fraction - old.detwinned_fraction)
        grown = grown + law.effect_strain(new) - law.effect_strain(old)
        thermal = law.thermal_modulus * (new.temperature - old.temperature)
        return old.strain + grown, old.stress + thermal, law.modulus(middle)


class IntegratedForm(AbstractForm):
    r"""Eq. 4.51 with eq. 3.2's thermal term: $\sigma = E(\xi)(\varepsilon - \varepsilon_L \xi_s) + \theta_T (T - T_\infty)$.

    A function of state: every closed cycle closes. The strain counts from the wire's start, as everywhere.
    """

    def elastic_line(self, law: Elasticity, old: WireState, new: WireState) -> tuple[Scalar, Scalar, Scalar]:
        def thermal(at: WireState) -> Scalar:
            return law.thermal_modulus * (at.temperature - law.ambient_temperature)

        def inelastic(at: WireState) -> Scalar:
            grown = law.transformation_strain(at.martensite_fraction) * at.detwinned_fraction
            return grown + law.effect_strain(at)

        elastic = (old.stress - thermal(old)) / law.modulus(old.martensite_fraction)
        strain = old.strain - elastic + inelastic(new) - inelastic(old)
        return strain, thermal(new), law.modulus(new.martensite_fraction)
