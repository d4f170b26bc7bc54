"""What effects with a second transformation range have in common: a part of the wire that follows another curve."""

from __future__ import annotations

import abc

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar
from smajax.model.wire.kinetics_terms import ShapeTerm

SWITCHES = ("heating_weight", "cooling_weight")


class AbstractSecondRange(AbstractEffect, ShapeTerm):
    r"""$h = (1 - w) h(z) + w\,h_2\big((z - 1/2 - s)/b\big)$ with its own w and s by branch and one width b, which a subclass has.

    As by the R-phase on cooling: `cooling_weight` of the wire transforms in a range of its own, `cooling_shift` ranges from
    the other. Only its strain is that of martensite here.
    """

    heating_weight: Scalar = parameter(
        "-", 0.0, 0.8, "w on heating: share of the wire with the second range", default=0.0
    )
    cooling_weight: Scalar = parameter("-", 0.0, 0.8, "w on cooling", default=0.0)
    heating_shift: Scalar = parameter(
        "-", -3.0, 3.0, "s on heating: centre of the second range, in ranges from mid-range", default=0.0
    )
    cooling_shift: Scalar = parameter("-", -3.0, 3.0, "s on cooling", default=0.0)
    width: Scalar = parameter("-", 0.15, 25.0, "b: width of the second range, in transformation ranges", default=1.0)

    @abc.abstractmethod
    def second(self, beyond: Scalar) -> Scalar:
        """What the second range has yet to transform, 1 to 0, at `beyond` of its widths after its middle."""

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        left = self.second((z - 0.5 - self.heating_shift) / self.width)
        return (1.0 - self.heating_weight) * remaining + self.heating_weight * left

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        # z falls from 1 to 0 on cooling.
        left = self.second(-(z - 0.5 - self.cooling_shift) / self.width)
        return (1.0 - self.cooling_weight) * remaining + self.cooling_weight * left
