"""Two-way memory: a trained wire lengthens on cooling with no stress on it."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.wire import Wire


class TwoWayMemory(AbstractEffect, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= a\,\varepsilon_L (\xi - \xi_s)$: the twinned part of the martensite strains as well.

    For Brinson's split, in which martensite formed without stress gives no strain. Under the laws without a split all
    martensite is detwinned and eps_L itself is the strain at zero stress: there this changes nothing, and
    `stress_dependent_strain` says how much a stress adds to it.
    """

    # Below one: a stress that detwins must not shorten the wire.
    share: Scalar = parameter("-", 0.0, 0.9, "a: two-way strain over eps_L", default=0.0)

    effect_name: ClassVar[str] = "two_way_memory"
    candidate: ClassVar[Candidate] = Candidate(
        title="two-way memory strain",
        equation="constitutive",
        formula="strain += a eps_L (xi - xi_s) (eq. 2.16; usual form of the trained two-way strain)",
        sentence="The wire is trained: it lengthens on cooling even where hardly any load pulls on it.",
        switches=("share",),
        initial_guess={"share": 0.1},
        prior_class="bench",
        widths={
            "share": Width(0.3, "trained NiTi: 1 to 3 % of two-way strain, of 4 to 6 %"),
        },
    )

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.share * wire.constitutive.recoverable_strain * (at.martensite_fraction - at.detwinned_fraction)
