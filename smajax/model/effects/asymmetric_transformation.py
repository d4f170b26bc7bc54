"""Asymmetric shape: a transformation that starts sharply and ends slowly, or the other way round."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import TRANSFORMATION_SHAPE, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.kinetics_terms import ShapeTerm


def _skewed(share: Scalar, skew: Scalar) -> Scalar:
    # 0 and 1 stay where they are, and the map rises monotonically for |skew| < 1. It works on the share that is
    # left, not on the temperature, so that it goes together with curves that have no end.
    return share + skew * share * (1.0 - share)


class AsymmetricTransformation(AbstractEffect, ShapeTerm):
    r"""$h \to h + a h (1 - h)$, its own a for heating and for cooling; a > 0 transforms late."""

    heating: Scalar = parameter(
        "-", -0.95, 0.95, "a of the martensite-to-austenite curve; > 0: martensite lasts longer", default=0.0
    )
    cooling: Scalar = parameter(
        "-", -0.95, 0.95, "a of the austenite-to-martensite curve; > 0: austenite lasts longer", default=0.0
    )

    effect_name: ClassVar[str] = "asymmetric_transformation"
    candidate: ClassVar[Candidate] = Candidate(
        title="asymmetric transformation",
        equation="kinetics",
        formula="h -> h + a h (1 - h) in eq. 3.3 and 3.5, a by branch",
        sentence="The transformation does not run evenly through its range: it starts sharply and ends slowly, or the "
        "reverse, and differently on heating and on cooling.",
        switches=("heating", "cooling"),
        initial_guess={"heating": 0.2, "cooling": 0.2},
        prior_class="material",
        exclusive_group=TRANSFORMATION_SHAPE,
        widths={
            "heating": Width(0.4, "calorimetry of NiTi: peaks with one steep and one slow side"),
            "cooling": Width(0.4, "calorimetry of NiTi: peaks with one steep and one slow side"),
        },
    )

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _skewed(remaining, self.heating)

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return _skewed(remaining, self.cooling)
