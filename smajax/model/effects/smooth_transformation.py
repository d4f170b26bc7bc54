"""Rounded start and finish: an S shape without corners in the place of the cosine."""

from __future__ import annotations

from typing import ClassVar

import jax

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import TRANSFORMATION_SHAPE, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.kinetics_terms import ShapeTerm

# The logistic curve with this steepness has the slope of the cosine in mid-range (pi/2 = steepness/4).
STEEPNESS = 6.283185307179586


class SmoothTransformation(AbstractEffect, ShapeTerm):
    r"""$h = (1 - w) h_{cos} + w / (1 + e^{2\pi (z - 1/2)})$, the same slope in mid-range and no corner at the ends."""

    weight: Scalar = parameter("-", 0.0, 1.0, "w: share of the rounded curve", default=0.0)

    effect_name: ClassVar[str] = "smooth_transformation"
    candidate: ClassVar[Candidate] = Candidate(
        title="smooth transformation",
        equation="kinetics",
        formula="h = (1 - w) h_cos(z) + w / (1 + exp[2 pi (z - 1/2)]) in eq. 3.3 and 3.5, z the reduced distance",
        sentence="The transformation starts before A_s and ends after A_f (and the same on cooling): grains of a real wire "
        "do not switch at one temperature.",
        switches=("weight",),
        initial_guess={"weight": 0.3},
        prior_class="material",
        exclusive_group=TRANSFORMATION_SHAPE,
        widths={
            "weight": Width(0.3, "calorimetry of NiTi: peaks with rounded ends"),
        },
    )

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return (1.0 - self.weight) * remaining + self.weight * jax.nn.sigmoid(-STEEPNESS * (z - 0.5))

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return (1.0 - self.weight) * remaining + self.weight * jax.nn.sigmoid(STEEPNESS * (z - 0.5))
