"""Constitutive law: strain, temperature and martensite fraction -> stress, in rate (eq. 3.2) or integrated form (4.51)."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, having
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import kept_after
from smajax.model.wire.root import root
from smajax.model.wire.stiffness import AbstractStiffness, Mixed

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class AbstractForm(eqx.Module):
    """How eq. 3.2 is carried from one state to the next."""

    @abc.abstractmethod
    def elastic_line(
        self, wire: Wire, effects: Sequence[AbstractEffect], old: WireState, new: WireState
    ) -> tuple[Scalar, Scalar, Scalar]:
        """(strain, stress at it, modulus): a point of the straight line of stress over strain at `new`, and its slope.

        The stress and strain of `new` itself are guesses.
        """


class RateForm(AbstractForm):
    r"""Eq. 3.2, $\dot\sigma = E \dot\varepsilon + \theta_T \dot T + \Omega \dot\xi_s$, over one step with E at the middle fraction.

    With E(xi) this is not the derivative of any sigma(strain, T, xi): a cycle that transforms at one stress and returns
    at another does not close. With a constant E it is, and agrees with the integrated form.
    """

    def elastic_line(
        self, wire: Wire, effects: Sequence[AbstractEffect], old: WireState, new: WireState
    ) -> tuple[Scalar, Scalar, Scalar]:
        law = wire.constitutive
        middle = 0.5 * (old.martensite_fraction + new.martensite_fraction)
        grown = transformation_strain(wire, middle) * (new.detwinned_fraction - old.detwinned_fraction)
        grown = grown + effect_strain(wire, effects, new) - effect_strain(wire, effects, old)
        thermal = law.thermal_modulus * (new.temperature - old.temperature)
        return old.strain + grown, old.stress + thermal, young_modulus(wire, middle, effects)


class IntegratedForm(AbstractForm):
    r"""Eq. 4.51 with eq. 3.2's thermal term: $\sigma = E(\xi)(\varepsilon - \varepsilon_L \xi_s) + \theta_T (T - T_\infty)$.

    A function of state: every closed cycle closes. The strain counts from the wire's start, as everywhere.
    """

    def elastic_line(
        self, wire: Wire, effects: Sequence[AbstractEffect], old: WireState, new: WireState
    ) -> tuple[Scalar, Scalar, Scalar]:
        def thermal(at: WireState) -> Scalar:
            return wire.constitutive.thermal_modulus * (at.temperature - wire.heat.ambient_temperature)

        def own(at: WireState) -> Scalar:
            grown = transformation_strain(wire, at.martensite_fraction) * at.detwinned_fraction
            return grown + effect_strain(wire, effects, at)

        elastic = (old.stress - thermal(old)) / young_modulus(wire, old.martensite_fraction, effects)
        strain = old.strain - elastic + own(new) - own(old)
        return strain, thermal(new), young_modulus(wire, new.martensite_fraction, effects)


class Constitutive(eqx.Module):
    """Constants of eq. 3.2, which of them depend on the fraction, and the form in which it is integrated."""

    young_modulus_austenite: Scalar = parameter("Pa", 1e9, 2e11, "E_A")
    young_modulus_martensite: Scalar = parameter("Pa", 1e9, 2e11, "E_M")
    recoverable_strain: Scalar = parameter("-", 0.0, 0.12, "eps_L: strain between all martensite and all austenite")
    thermal_modulus: Scalar = parameter(
        "Pa/K", -5e6, 5e6, "theta_T = -E alpha; the source prints +0.55 MPa/C, which is a wire that shrinks when heated"
    )
    stiffness: AbstractStiffness = Mixed()
    form: AbstractForm = RateForm()


def young_modulus(wire: Wire, fraction: Scalar, effects: Sequence[AbstractEffect] = ()) -> Scalar:
    r"""$E = E_A + \xi (E_M - E_A)$, Pa (Elahinia 2004, eq. 3.15), or what the law's stiffness says instead, and the effects' share."""
    law = wire.constitutive
    own = law.stiffness.young_modulus(law.young_modulus_austenite, law.young_modulus_martensite, fraction)
    return own + sum(effect.modulus_change(wire, fraction) for effect in having(effects, "modulus_change"))


def transformation_strain(wire: Wire, fraction: Scalar) -> Scalar:
    r"""$-\Omega/E$, the strain of one unit of detwinned fraction: eps_L where Omega = -E eps_L."""
    law = wire.constitutive
    return law.stiffness.transformation_strain(
        law.young_modulus_austenite, law.young_modulus_martensite, law.recoverable_strain, fraction
    )


def effect_strain(wire: Wire, effects: Sequence[AbstractEffect], at: WireState) -> Scalar | float:
    """Strain that the effects add to eps_L xi_s and the elastic part, a function of state, -."""
    state = at.temperature, at.stress, at.martensite_fraction, at.detwinned_fraction
    return sum(effect.strain(wire, *state) + effect.kept_strain(at) for effect in effects)


def _tried(
    wire: Wire, effects: Sequence[AbstractEffect], old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> WireState:
    """`old` with the unknowns of a step put in, and the detwinned part and the memory that belong to them."""
    detwinned = wire.kinetics.variants.detwinned(old, stress, xi)
    changed = {
        "temperature": temperature,
        "stress": stress,
        "martensite_fraction": xi,
        "detwinned_fraction": detwinned,
        "kept": kept_after(effects, old, temperature, stress, xi),
    }
    return dataclasses.replace(old, **changed)


def stress_at(
    wire: Wire,
    effects: Sequence[AbstractEffect],
    old: WireState,
    strain: Scalar,
    temperature: Scalar,
    stress: Scalar,
    xi: Scalar,
) -> Scalar:
    """Stress that `strain` asks for, Pa; zero when the wire is slack. `stress` is the guess that effects see.

    Solved together with the fraction, never after it: a fraction that is clipped once the stress has used its rate
    leaves a strain error for good.
    """

    def asked(guess: Scalar) -> Scalar:
        new = _tried(wire, effects, old, temperature, guess, xi)
        at, stress_there, modulus = wire.constitutive.form.elastic_line(wire, effects, old, new)
        pulled = stress_there + modulus * (strain - at)
        return jnp.where(pulled < 0.0, 0.0, pulled)

    if not wire.kinetics.variants.detwins:
        return asked(stress)
    # Detwinning answers a stress with far more strain than elasticity does, and `asked` falls as its guess rises: the
    # stress that asks for itself lies between zero and `asked(0)`.
    zero = jnp.zeros_like(stress)
    high = asked(zero)
    return root(lambda guess: guess - asked(guess), high, zero, high, young_modulus(wire, xi, effects))


def strain_at(
    wire: Wire, effects: Sequence[AbstractEffect], old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> Scalar:
    """The wire's own strain at a given stress, -: the same law read the other way round."""
    new = _tried(wire, effects, old, temperature, stress, xi)
    at, stress_there, modulus = wire.constitutive.form.elastic_line(wire, effects, old, new)
    return at + (stress - stress_there) / modulus
