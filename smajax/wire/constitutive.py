"""Constitutive law in rate form (eq. 3.2): strain, temperature and martensite fraction -> stress."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar, WireState

if TYPE_CHECKING:
    from smajax.wire.wire import Wire


class Constitutive(eqx.Module):
    """Constants of eq. 3.2 with E(xi) of eq. 3.15."""

    young_modulus_austenite: Scalar = parameter("Pa", 1e9, 2e11, "E_A")
    young_modulus_martensite: Scalar = parameter("Pa", 1e9, 2e11, "E_M")
    recoverable_strain: Scalar = parameter("-", 0.0, 0.12, "eps_L: strain between all martensite and all austenite")
    thermal_modulus: Scalar = parameter(
        "Pa/K", -5e6, 5e6, "theta_T = -E alpha; the source prints +0.55 MPa/C, which is a wire that shrinks when heated"
    )


def young_modulus(wire: Wire, fraction: Scalar) -> Scalar:
    r"""$E = E_A + \xi (E_M - E_A)$, Pa (Elahinia 2004, eq. 3.15)."""
    law = wire.constitutive
    return law.young_modulus_austenite + fraction * (law.young_modulus_martensite - law.young_modulus_austenite)


def state_strain(
    wire: Wire, effects: Sequence[AbstractEffect], temperature: Scalar, stress: Scalar, fraction: Scalar
) -> Scalar:
    r"""$\varepsilon_L \xi$ and what effects add to it: the strain that is a function of state, -."""
    base = wire.constitutive.recoverable_strain * fraction
    return base + sum(effect.strain(wire, temperature, stress, fraction) for effect in effects)


def unloaded_strain(
    wire: Wire, effects: Sequence[AbstractEffect], old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> tuple[Scalar, Scalar]:
    r"""(strain at which the stress would be zero, modulus) after a step from `old`.

    Eq. 3.2, $\dot\sigma = E \dot\varepsilon + \theta_T \dot T + \Omega \dot\xi$ with $\Omega = -E(\xi) \varepsilon_L$,
    is taken over one step with E at the middle fraction. It is solved together with the fraction, never after it: a
    fraction that is clipped once the stress has used its rate leaves a strain error for good.
    """
    modulus = young_modulus(wire, 0.5 * (old.martensite_fraction + xi))
    grown = state_strain(wire, effects, temperature, stress, xi) - state_strain(
        wire, effects, old.temperature, old.stress, old.martensite_fraction
    )
    thermal = wire.constitutive.thermal_modulus * (temperature - old.temperature)
    return old.strain + grown - (old.stress + thermal) / modulus, modulus


def stress_at(
    wire: Wire,
    effects: Sequence[AbstractEffect],
    old: WireState,
    strain: Scalar,
    temperature: Scalar,
    stress: Scalar,
    xi: Scalar,
) -> Scalar:
    """Stress that `strain` asks for, Pa; zero when the wire is slack. `stress` is the guess that effects see."""
    free, modulus = unloaded_strain(wire, effects, old, temperature, stress, xi)
    return modulus * jnp.maximum(strain - free, 0.0)


def strain_at(
    wire: Wire, effects: Sequence[AbstractEffect], old: WireState, temperature: Scalar, stress: Scalar, xi: Scalar
) -> Scalar:
    """The wire's own strain at a given stress, -: the same law read the other way round."""
    free, modulus = unloaded_strain(wire, effects, old, temperature, stress, xi)
    return free + stress / modulus
