"""Electrical resistance of the wire (eq. 3.15): martensite fraction -> ohm per metre."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.heat import cross_section

if TYPE_CHECKING:
    from smajax.model.wire.wire import Wire


class Resistance(eqx.Module):
    """Resistivity of the two phases."""

    resistivity_austenite: Scalar = parameter("ohm m", 1e-7, 1e-5, "resistivity of austenite")
    resistivity_martensite: Scalar = parameter("ohm m", 1e-7, 1e-5, "resistivity of martensite")


def resistance_per_metre(
    wire: Wire, effects: Sequence[AbstractEffect], temperature: Scalar, fraction: Scalar
) -> Scalar:
    r"""$R = R_A + \xi (R_M - R_A)$, ohm/m (Elahinia 2004, eq. 3.15)."""
    law = wire.resistance
    resistivity = law.resistivity_austenite + fraction * (law.resistivity_martensite - law.resistivity_austenite)
    factor = 1.0 + sum(effect.resistance_factor(temperature, fraction) for effect in effects)
    return resistivity * factor / cross_section(wire)
