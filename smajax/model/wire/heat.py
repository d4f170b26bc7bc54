"""Heat balance of the wire, per metre (eq. 3.1): electrical power, T -> temperature."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect, having
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class Heat(eqx.Module):
    """Constants of eq. 3.1."""

    density: Scalar = parameter("kg/m^3", 1e3, 2e4, "density of the wire")
    specific_heat: Scalar = parameter("J/(kg K)", 50.0, 5e3, "specific heat of the wire")
    convection_coefficient: Scalar = parameter("W/(m^2 K)", 1.0, 5e3, "heat lost per surface and degree")
    ambient_temperature: Scalar = parameter("degC", -100.0, 150.0, "temperature of the air around the wire")


def mass_per_metre(wire: Wire) -> Scalar:
    """m = rho pi d^2 / 4, kg/m (Elahinia 2004, below eq. 3.1)."""
    return wire.heat.density * cross_section(wire)


def cross_section(wire: Wire) -> Scalar:
    """A_w = pi d^2 / 4, m^2."""
    return 0.25 * jnp.pi * wire.wire_diameter**2


def stored_heat(wire: Wire, effects: Sequence[AbstractEffect], temperature: Scalar, fraction: Scalar) -> Scalar:
    """m c_p T, J/m: the quantity whose rate eq. 3.1 gives. An effect may store heat in the phases as well."""
    base = mass_per_metre(wire) * wire.heat.specific_heat * temperature
    return base + sum(effect.stored_heat(wire, temperature, fraction) for effect in effects)


def heat_rate(
    wire: Wire,
    effects: Sequence[AbstractEffect],
    temperature: Scalar,
    ambient: Scalar,
    power: Scalar,
    time: Scalar,
) -> Scalar:
    r"""$m c_p \dot T = I^2 R - h_c A_c (T - T_\infty)$, the right-hand side, W/m (Elahinia 2004, eq. 3.1).

    `power` is the electrical power per metre; R, m and A_c of Table 3.1 are per metre too, which it does not say.
    """
    surface = jnp.pi * wire.wire_diameter
    loss = wire.heat.convection_coefficient * surface * (temperature - ambient)
    changing = having(effects, "convection_change")
    if changing:
        loss = loss * (1.0 + sum(effect.convection_change(time) for effect in changing))
    return power - loss - sum(effect.heat_loss(wire, temperature, ambient) for effect in effects)
