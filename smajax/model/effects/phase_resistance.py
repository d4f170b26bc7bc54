"""Resistance that depends on the phase beyond what the base model has."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.resistance import ResistanceTerm


class PhaseResistance(AbstractEffect, ResistanceTerm):
    r"""$R = R_{base} [1 + a (1 - \xi)]$: eq. 3.15 with a phase contrast of its own.

    The base model has a resistivity of each phase. Where a fit has that of austenite free, it tells all that the contrast does, and this is not
    looked for.
    """

    contrast: Scalar = parameter("-", -0.5, 0.5, "a: relative change of R from martensite to austenite", default=0.0)

    effect_name: ClassVar[str] = "phase_resistance"
    candidate: ClassVar[Candidate] = Candidate(
        title="resistance depending on the phase",
        equation="electrical",
        formula="R = R_base [1 + a (1 - xi)] (Elahinia 2004, eq. 3.15)",
        sentence="Austenite and martensite conduct differently: at a given voltage the heating power changes as the wire "
        "transforms.",
        switches=("contrast",),
        initial_guess={"contrast": -0.1},
        same_as=("resistivity_austenite",),
        prior_class="material",
        widths={
            "contrast": Width(
                0.2,
                "Elahinia 2004, Table 3.2: 76 and 84 uohm cm; NiTi data sheets: 80 and 100; of strained wires and with an R-phase as low as -0.2",
            ),
        },
    )

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return self.contrast * (1.0 - fraction)
