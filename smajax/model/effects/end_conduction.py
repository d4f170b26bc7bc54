"""Clamps that keep the wire's ends cool: they transform later than its middle, or not at all."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.kinetics_terms import ShapeTerm
from smajax.model.wire.shape import Cosine

# Pieces of a zone: (1 - f) at the middle of each, of DEPTH lengths 1/mu in all.
DEPTH, PIECES = 3.0, 4
MISSING = tuple(math.exp(-DEPTH * (k + 0.5) / PIECES) for k in range(PIECES))


class EndConduction(AbstractEffect, ShapeTerm):
    r"""$h \to (1 - w) h + \frac{w}{n} \sum_i S(z - (1 - f_i)(z + q))$: n pieces of the two end zones, share w of the wire.

    A fin between clamps at the temperature of the air has $T - T_\infty$ less by $1 - \cosh(\mu s)/\cosh(\mu l_0/2)$, s from
    the middle, $\mu^2 = 4 h_c/(k d)$; where $\mu l_0 \gg 1$, as for any thin wire, it is $f = 1 - e^{-\zeta}$ at $\zeta/\mu$ from a clamp.
    A zone is three such lengths, so $w = 6/(\mu l_0)$. Its pieces transform at z of their own temperature, q ranges being
    from the air to the start of the range; S is the cosine of eq. 3.3 and 3.5.

    Quasi-static, and the same stress everywhere. Neglected: the heat that the clamps take, which is proportional to
    $T - T_\infty$ and counts as convection, and that zones of other temperature have another resistance.
    """

    share: Scalar = parameter("-", 0.0, 0.5, "w: share of the wire that lies in the two end zones", default=0.0)
    above_air_heating: Scalar = parameter(
        "-", 0.5, 50.0, "q on heating: (A_s + sigma/C_A - T_inf)/(A_f - A_s), about", default=5.0
    )
    above_air_cooling: Scalar = parameter(
        "-", 0.5, 50.0, "q on cooling: (M_f + sigma/C_M - T_inf)/(M_s - M_f), about", default=3.0
    )

    effect_name: ClassVar[str] = "end_conduction"
    candidate: ClassVar[Candidate] = Candidate(
        title="cool ends (conduction into the clamps)",
        equation="heat",
        formula="T(s) = T_inf + (T - T_inf)[1 - cosh(mu s)/cosh(mu l_0/2)], mu^2 = 4 h_c/(k d) (fin equation, any heat-transfer "
        "handbook): h of eq. 3.3 and 3.5 is its mean over the wire",
        sentence="The clamps keep the ends of the wire cool: the last part of the stroke needs a wire far hotter than the rest "
        "does, and the ends turn back first.",
        switches=("share",),
        initial_guess={"share": 0.05, "above_air_heating": 5.0, "above_air_cooling": 3.0},
        prior_class="material",
        widths={
            "share": Width(
                0.1,
                "6/(mu l_0) with k = 8.6 to 18 W/(m K) (NiTi data sheets): 0.04 for 150 um and 250 mm, 0.16 for 500 um and 200 mm",
            ),
            "above_air_heating": Width(
                0.5, "its definition, of the wires of Table 3.2 and of data sheets: 3 to 8", logarithmic=True
            ),
            "above_air_cooling": Width(
                0.5, "its definition, of the wires of Table 3.2 and of data sheets: 2 to 5", logarithmic=True
            ),
        },
    )

    def _mixed(self, z: Scalar, remaining: Scalar, distance: Scalar, left: Callable[[Scalar], Scalar]) -> Scalar:
        ends = sum(left(z - missing * (z + distance)) for missing in MISSING)
        return (1.0 - self.share) * remaining + self.share / PIECES * ends

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return self._mixed(z, remaining, self.above_air_heating, Cosine().martensite_left)

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        return self._mixed(z, remaining, self.above_air_cooling, Cosine().austenite_left)
