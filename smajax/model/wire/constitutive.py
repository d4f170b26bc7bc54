"""Constitutive law: strain, temperature and martensite fraction -> stress, in rate (eq. 3.2) or integrated form (4.51)."""

from __future__ import annotations

import abc
import dataclasses
from typing import NamedTuple

import jax.numpy as jnp

from smajax.model.types import Scalar, WireState
from smajax.model.wire.form import Elasticity
from smajax.model.wire.history import HistoryTerm, history_after
from smajax.model.wire.root import root
from smajax.model.wire.wire import Wire


class ConstitutiveTerm(abc.ABC):  # noqa: B024  # each method by itself is enough
    """What an effect may change in eq. 3.2 (4.51)."""

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        """Strain beside eps_L xi_s and the elastic part, a function of the state `at`, its history included, -."""
        return 0.0

    def modulus_change(self, wire: Wire, fraction: Scalar) -> Scalar | float:
        """Added to Young's modulus of the base model, Pa; the sum must stay above zero."""
        return 0.0


class ConstitutiveTerms(NamedTuple):
    """All that effects change in the constitutive law of one wire."""

    changes: tuple[ConstitutiveTerm, ...] = ()
    history: tuple[HistoryTerm, ...] = ()  # which the strain may depend on


NO_TERMS = ConstitutiveTerms()


def young_modulus(wire: Wire, fraction: Scalar, terms: ConstitutiveTerms = NO_TERMS) -> Scalar:
    r"""$E = E_A + \xi (E_M - E_A)$, Pa (Elahinia 2004, eq. 3.15), or what the law's stiffness says instead, and the effects' share."""
    law = wire.constitutive
    base = law.stiffness.young_modulus(law.young_modulus_austenite, law.young_modulus_martensite, fraction)
    return base + sum(term.modulus_change(wire, fraction) for term in terms.changes)


def transformation_strain(wire: Wire, fraction: Scalar) -> Scalar:
    r"""$-\Omega/E$, the strain of one unit of detwinned fraction: eps_L where Omega = -E eps_L."""
    law = wire.constitutive
    return law.stiffness.transformation_strain(
        law.young_modulus_austenite, law.young_modulus_martensite, law.recoverable_strain, fraction
    )


def effect_strain(wire: Wire, terms: ConstitutiveTerms, at: WireState) -> Scalar | float:
    """Strain that the effects add to eps_L xi_s and the elastic part, a function of state, -."""
    return sum(term.strain(wire, at) for term in terms.changes)


def _elastic_line(
    wire: Wire, terms: ConstitutiveTerms, old: WireState, new: WireState
) -> tuple[Scalar, Scalar, Scalar]:
    law = Elasticity(
        modulus=lambda fraction: young_modulus(wire, fraction, terms),
        transformation_strain=lambda fraction: transformation_strain(wire, fraction),
        effect_strain=lambda at: effect_strain(wire, terms, at),
        thermal_modulus=wire.constitutive.thermal_modulus,
        ambient_temperature=wire.heat.ambient_temperature,
    )
    return wire.constitutive.form.elastic_line(law, old, new)


def _trial(
    wire: Wire, terms: ConstitutiveTerms, old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> WireState:
    """`old` with the unknowns of a step put in, and the detwinned part and the history that belong to them."""
    new = dataclasses.replace(
        old,
        temperature=temperature,
        stress=stress,
        martensite_fraction=xi,
        detwinned_fraction=wire.kinetics.variants.detwinned(old, stress, xi),
    )
    return dataclasses.replace(new, history=history_after(terms.history, old, new))


def stress_at(
    wire: Wire,
    terms: ConstitutiveTerms,
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

    def pulled(guess: Scalar) -> Scalar:
        new = _trial(wire, terms, old, temperature, guess, xi)
        at, stress_there, modulus = _elastic_line(wire, terms, old, new)
        tension = stress_there + modulus * (strain - at)
        return jnp.where(tension < 0.0, 0.0, tension)

    if not wire.kinetics.variants.detwins:
        return pulled(stress)
    # Detwinning answers a stress with far more strain than elasticity does, and `pulled` falls as its guess rises: the
    # stress that gives itself lies between zero and `pulled(0)`.
    zero = jnp.zeros_like(stress)
    high = pulled(zero)
    return root(lambda guess: guess - pulled(guess), high, zero, high, young_modulus(wire, xi, terms))


def reached(
    wire: Wire, terms: ConstitutiveTerms, old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> WireState:
    """The wire after a step from `old` to (`temperature`, `stress`, `xi`): the same law read the other way round.

    Its strain, detwinned part and history are those of the end; the amplitudes of its branches are still those of `old`
    (`two_populations.with_amplitudes`).
    """
    new = _trial(wire, terms, old, temperature, stress, xi)
    at, stress_there, modulus = _elastic_line(wire, terms, old, new)
    return dataclasses.replace(new, strain=at + (stress - stress_there) / modulus)
