"""Heat balance of the wire, per metre (eq. 3.1): electrical power, T -> temperature."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp

from smajax.model.types import Scalar, WireState
from smajax.model.wire.wire import Wire


class HeatState(NamedTuple):
    """Where the heat balance is taken, at the end of a step (or of a stage of one)."""

    temperature: Scalar  # C
    ambient: Scalar  # of the air, with what effects shift it by, C
    fraction: Scalar  # martensite, -
    time: Scalar  # from the start of the run, s
    old: WireState  # the wire before the step
    duration: Scalar  # of the step, s


class HeatTerm(abc.ABC):  # noqa: B024  # each method by itself is enough
    """What an effect may change in eq. 3.1.

    A change of the convection is a loss in proportion to the convection's; heat that a change takes and that is no
    function of the state (of temperature and fraction) is a loss too: so much over the duration of the step.
    """

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        """Heat stored per metre beside m c_p T, a function of state, J/m."""
        return 0.0

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        """Heat lost per metre beside h_c A_c (T - T_inf), W/m."""
        return 0.0

    def ambient_shift(self, time: Scalar) -> Scalar | float:
        """Added to the ambient temperature, C."""
        return 0.0


def mass_per_metre(wire: Wire) -> Scalar:
    """m = rho pi d^2 / 4, kg/m (Elahinia 2004, below eq. 3.1)."""
    return wire.heat.density * cross_section(wire)


def cross_section(wire: Wire) -> Scalar:
    """A_w = pi d^2 / 4, m^2."""
    return 0.25 * jnp.pi * wire.wire_diameter**2


def stored_heat(wire: Wire, terms: Sequence[HeatTerm], temperature: Scalar, fraction: Scalar) -> Scalar:
    """m c_p T, J/m: the quantity whose rate eq. 3.1 gives. An effect may store heat in the phases as well."""
    base = mass_per_metre(wire) * wire.heat.specific_heat * temperature
    return base + sum(term.stored_heat(wire, temperature, fraction) for term in terms)


def convection(wire: Wire, temperature: Scalar, ambient: Scalar) -> Scalar:
    """h_c A_c (T - T_inf), W/m: what the wire loses to the air."""
    surface = jnp.pi * wire.wire_diameter
    return wire.heat.convection_coefficient * surface * (temperature - ambient)


def heat_rate(wire: Wire, terms: Sequence[HeatTerm], at: HeatState, power: Scalar) -> Scalar:
    r"""$m c_p \dot T = I^2 R - h_c A_c (T - T_\infty)$, the right-hand side, W/m (Elahinia 2004, eq. 3.1).

    `power` is the electrical power per metre; R, m and A_c of Table 3.1 are per metre too, which it does not say.
    """
    return power - convection(wire, at.temperature, at.ambient) - sum(term.heat_loss(wire, at) for term in terms)
