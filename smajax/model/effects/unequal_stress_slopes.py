"""Another stress slope on cooling than on heating."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, several_forces
from smajax.model.types import Scalar, WireState
from smajax.model.wire.kinetics import cooling_width, heating_width
from smajax.model.wire.kinetics_terms import RangeTerm
from smajax.model.wire.wire import Kinetics


class UnequalStressSlopes(AbstractEffect, RangeTerm):
    r"""$y_A = T - (1 + a) \sigma/C_A$, $y_M = T - (1 + b) \sigma/C_M$: stress moves each range by an amount of its own.

    C_A and C_M are parameters of the base model and equal in every preset; this says that they differ, from the preset's
    and from each other. Where a fit has both free, as unknowns or as values of a preset that nobody measured on this wire, these
    parameters tell it all, and it is not looked for.
    """

    heating: Scalar = parameter(
        "-", -0.8, 3.0, "a: how much more the heating range moves with stress than C_A says", default=0.0
    )
    cooling: Scalar = parameter(
        "-", -0.8, 3.0, "b: how much more the cooling range moves with stress than C_M says", default=0.0
    )

    effect_name: ClassVar[str] = "unequal_stress_slopes"
    candidate: ClassVar[Candidate] = Candidate(
        title="unequal stress slopes",
        equation="kinetics",
        formula="y_A = T - (1 + a) sigma/C_A in eq. 3.3, y_M = T - (1 + b) sigma/C_M in eq. 3.5 (C_A and C_M of their own: Liang and "
        "Rogers 1990)",
        sentence="A heavier load moves the cooling stroke by another number of degrees than the heating stroke: the hysteresis "
        "gets wider or narrower with the load.",
        switches=("heating", "cooling"),
        initial_guess={"heating": 0.1, "cooling": 0.1},
        observable=several_forces,
        same_as=("stress_slope_austenite", "stress_slope_martensite"),
        prior_class="material",
        widths={
            "heating": Width(
                0.3,
                "stress slopes of NiTi: 5 to 8 MPa/K, of either phase; Elahinia 2004, Table 3.2: 6.89 MPa/K",
            ),
            "cooling": Width(
                0.3,
                "stress slopes of NiTi: 5 to 8 MPa/K, of either phase; Elahinia 2004, Table 3.2: 6.89 MPa/K",
            ),
        },
    )

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.heating * stress / (law.stress_slope_austenite * heating_width(law))

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.cooling * stress / (law.stress_slope_martensite * cooling_width(law))
