"""Electrical resistance of the wire (eq. 3.15): martensite fraction -> ohm per metre."""

from __future__ import annotations

import abc
from collections.abc import Sequence

from smajax.model.types import Scalar
from smajax.model.wire.heat import cross_section
from smajax.model.wire.wire import Wire


class ResistanceTerm(abc.ABC):
    """What an effect may change in eq. 3.15."""

    @abc.abstractmethod
    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        """Relative change of the resistance per metre, -."""


def resistance_per_metre(wire: Wire, terms: Sequence[ResistanceTerm], temperature: Scalar, fraction: Scalar) -> Scalar:
    r"""$R = R_A + \xi (R_M - R_A)$, ohm/m (Elahinia 2004, eq. 3.15)."""
    law = wire.resistance
    resistivity = law.resistivity_austenite + fraction * (law.resistivity_martensite - law.resistivity_austenite)
    factor = 1.0 + sum(term.resistance_factor(temperature, fraction) for term in terms)
    return resistivity * factor / cross_section(wire)
