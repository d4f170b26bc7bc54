"""Resistance that rises with temperature."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.resistance import ResistanceTerm

REFERENCE = 20.0  # C


class TemperatureResistance(AbstractEffect, ResistanceTerm):
    r"""$R = R_{base} [1 + \alpha (T - 20)]$, the base resistivities being those at 20 C."""

    coefficient: Scalar = parameter(
        "1/K", -1e-3, 5e-3, "alpha: temperature coefficient of the resistivity", default=0.0
    )

    effect_name: ClassVar[str] = "temperature_resistance"
    candidate: ClassVar[Candidate] = Candidate(
        title="resistance depending on temperature",
        equation="electrical",
        formula="R = R_base [1 + alpha (T - 20 C)] (usual form of a metal, any electrical handbook)",
        sentence="A hot wire conducts worse than a cold one in the same phase: at a given voltage it gets less power, and a "
        "measured resistance goes on rising where nothing transforms.",
        negative_sentence="A hot wire conducts better than a cold one in the same phase: at a given voltage it gets more power, and a "
        "measured resistance goes on falling where nothing transforms.",
        switches=("coefficient",),
        initial_guess={"coefficient": 5e-4},
        prior_class="material",
        widths={
            "coefficient": Width(1e-3, "NiTi within a phase: 3e-4 to 1.5e-3 1/K; pure metals: 4e-3"),
        },
    )

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return self.coefficient * (temperature - REFERENCE)
