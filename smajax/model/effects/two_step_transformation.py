"""A transformation in two steps: a part of the wire in a range of its own."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.candidate import TRANSFORMATION_SHAPE, Candidate, Extent, Width
from smajax.model.effects.second_range import SWITCHES, AbstractSecondRange
from smajax.model.types import Scalar
from smajax.model.wire.shape import Cosine

WIDE = 5.0  # ranges: where a search begins


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    # A second step of its own, before or after the other on either way.
    sides = [(heating, cooling) for heating in (-1.0, 1.0) for cooling in (-1.0, 1.0)]
    return tuple({"heating_shift": one, "cooling_shift": other, "width": 1.0} for one, other in sides)


class TwoStepTransformation(AbstractSecondRange):
    r"""$h = (1 - w) h(z) + w h_{cos}\big((z - 1/2 - s)/b + 1/2\big)$ with its own w and s by branch and one width b.

    The second range ends like the first: with a tail without an end,
    as `two_part_transformation` has it, every warming transforms something, and the wire forgets where its cooling stopped.
    """

    width: Scalar = parameter("-", 0.3, 25.0, "b: width of the second range, in transformation ranges", default=WIDE)

    effect_name: ClassVar[str] = "two_step_transformation"
    candidate: ClassVar[Candidate] = Candidate(
        title="transformation in two steps",
        equation="kinetics",
        formula="h = (1 - w) h(z) + w h_cos((z - 1/2 - s)/b + 1/2) in eq. 3.3 and 3.5, w and s by branch",
        sentence=(
            "A part of the wire transforms in a range of its own, before or after the rest: an intermediate phase, or grains and "
            "grips under another stress."
        ),
        switches=SWITCHES,
        initial_guess={
            "heating_weight": 0.15,
            "cooling_weight": 0.15,
            "heating_shift": 0.0,
            "cooling_shift": 0.0,
            "width": WIDE,
        },
        grid=_grid,
        prior_class="bench",
        exclusive_group=TRANSFORMATION_SHAPE,
        widths={
            "heating_weight": Width(0.3, "a small share of the R-phase on heating, most of the strain in one step"),
            "cooling_weight": Width(0.3, "strain of the R-phase on cooling: a tenth to a third of the whole"),
            "heating_shift": Width(1.0, "R-phase and martensite 10 to 30 K apart, ranges of 10 to 20 K"),
            "cooling_shift": Width(1.0, "R-phase and martensite 10 to 30 K apart, ranges of 10 to 20 K"),
            "width": Width(1.5, "from one range to twenty", logarithmic=True),
        },
    )

    def second(self, beyond: Scalar) -> Scalar:
        return Cosine().martensite_left(beyond + 0.5)
