"""Transformation ranges that get wider (or narrower) with stress."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, several_forces
from smajax.model.types import Scalar, WireState
from smajax.model.wire.kinetics_terms import RangeTerm
from smajax.model.wire.wire import Kinetics


class StressDependentWidth(AbstractEffect, RangeTerm):
    r"""$A_f' - A_s' = (A_f - A_s)(1 + a \sigma)$ and $M_s' - M_f' = (M_s - M_f)(1 + b \sigma)$; the starts stay at $\sigma/C$.

    The same as slopes of their own for A_f and M_f.
    """

    # With -5e-10 the range is half as wide at 1 GPa, which no wire stands.
    heating: Scalar = parameter("1/Pa", -5e-10, 5e-8, "a: relative widening of A_f' - A_s' per stress", default=0.0)
    cooling: Scalar = parameter("1/Pa", -5e-10, 5e-8, "b: relative widening of M_s' - M_f' per stress", default=0.0)

    effect_name: ClassVar[str] = "stress_dependent_width"
    candidate: ClassVar[Candidate] = Candidate(
        title="transformation range depending on stress",
        equation="kinetics",
        formula="A_f' = A_s' + (A_f - A_s)(1 + a sigma), M_f' = M_s' - (M_s - M_f)(1 + b sigma) in eq. 3.3 and 3.5 (usual form: "
        "a stress slope for each of the four temperatures)",
        sentence="Under a heavier load the transformation is spread over more degrees: it starts where it should and ends late.",
        negative_sentence="Under a heavier load the transformation takes fewer degrees: it starts where it should and ends early.",
        switches=("heating", "cooling"),
        initial_guess={"heating": 1e-9, "cooling": 1e-9},
        observable=several_forces,
        prior_class="material",
        widths={
            "heating": Width(
                3e-9,
                "stress slopes of start and finish: 5 to 8 MPa/K, over a range of 10 to 20 K",
            ),
            "cooling": Width(
                3e-9,
                "stress slopes of start and finish: 5 to 8 MPa/K, over a range of 10 to 20 K",
            ),
        },
    )

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z / (1.0 + self.heating * stress)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        # z - (1 - z)(...): exactly z where b is zero.
        return z + (1.0 - z) * self.cooling * stress / (1.0 + self.cooling * stress)
