"""Two-part transformation: a sharp core and long tails."""

from __future__ import annotations

from typing import ClassVar

import jax

from smajax.core.parameters import parameter
from smajax.model.effects.candidate import TRANSFORMATION_SHAPE, Candidate, Width
from smajax.model.effects.second_range import SWITCHES, AbstractSecondRange
from smajax.model.types import Scalar


class TwoPartTransformation(AbstractSecondRange):
    r"""$h = (1 - w) h_{core} + w / (1 + e^{(z - 1/2 - s)/b})$ with its own w and s by branch and one width b.

    A transformation in two steps too, whose second never quite ends.
    """

    width: Scalar = parameter("-", 0.15, 4.0, "b: width of the tails, in transformation ranges", default=0.8)

    effect_name: ClassVar[str] = "two_part_transformation"
    candidate: ClassVar[Candidate] = Candidate(
        title="two-part transformation (sharp core, long tails)",
        equation="kinetics",
        formula=("h = (1 - w) h_cos(z) + w / (1 + exp[(z - 1/2 - s)/b]) in eq. 3.3 and 3.5, w and s by branch"),
        sentence=(
            "Most of the wire transforms in a narrow range while a part of it (its ends, its grips, grains of another "
            "orientation) follows over a much wider one."
        ),
        switches=SWITCHES,
        initial_guess={
            "heating_weight": 0.15,
            "cooling_weight": 0.15,
            "heating_shift": 0.0,
            "cooling_shift": 0.0,
            "width": 0.8,
        },
        prior_class="material",
        exclusive_group=TRANSFORMATION_SHAPE,
        widths={
            "heating_weight": Width(0.3, "grips, ends and grains of another orientation: some tenths of a wire"),
            "cooling_weight": Width(0.3, "grips, ends and grains of another orientation: some tenths of a wire"),
            "heating_shift": Width(0.5, "tails about the middle of the core, within half a range"),
            "cooling_shift": Width(0.5, "tails about the middle of the core, within half a range"),
            "width": Width(0.7, "tails of half to twice the range", logarithmic=True),
        },
    )

    def second(self, beyond: Scalar) -> Scalar:
        return jax.nn.sigmoid(-beyond)
