"""Minor loops: after a partial transformation the way back begins earlier."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.kinetics_terms import RangeTerm
from smajax.model.wire.wire import Kinetics


def _missing(amplitude: Scalar) -> Scalar:
    return jnp.where(amplitude > 1.0, 0.0, jnp.where(amplitude < 0.0, 1.0, 1.0 - amplitude))


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    # A little inside: at its bound a shape has one side only.
    return tuple({"small": small, "pinned": pinned} for small in (0.05, 0.95) for pinned in (0.05, 0.95))


class MinorLoops(AbstractEffect, RangeTerm):
    r"""$z_A \to z_A + e (1 - k z_A) / (1 + k e)$ with $e = a\,m (1 - r\,m) / \max_m m (1 - r\,m)$, $m = 1 - \xi_M$; $1 - z_M$ alike with b and $m = \xi_A$.

    The way back of a smaller loop starts earlier, by e of the range, a at most. With k = 0 its end comes earlier too, with k = 1 the
    end stays where it is. With r = 0 the smallest loop is shifted most, with r = 1 one of half a transformation. So a is what a
    source tells of minor loops, whichever is shifted most: were it the slope at small m, a prior of one width would say that r is small.

    xi_M and xi_A of eq. 3.26 are the fraction at the reversal: 1 and 0 in a full cycle, which this leaves as it is. The
    printed model begins every way back at A_s' or M_s', however little of the wire had transformed.
    """

    heating_shift: Scalar = parameter(
        "-",
        -0.8,
        1.5,
        "a: earlier start of heating in the loop that is shifted most, in transformation ranges",
        default=0.0,
    )
    cooling_shift: Scalar = parameter(
        "-",
        -0.8,
        1.5,
        "b: earlier start of cooling in the loop that is shifted most, in transformation ranges",
        default=0.0,
    )
    small: Scalar = parameter(
        "-", 0.0, 1.0, "r: how much less the smallest loops are shifted than those of half a stroke", default=0.0
    )
    pinned: Scalar = parameter(
        "-", 0.0, 1.0, "k: 1 where the end of the way back stays, 0 where it is shifted alike", default=0.0
    )

    effect_name: ClassVar[str] = "minor_loops"
    candidate: ClassVar[Candidate] = Candidate(
        title="way back in minor loops",
        equation="kinetics",
        formula="z_A + e (1 - k z_A)/(1 + k e) in eq. 3.3, e = a m (1 - r m) over the largest m (1 - r m), m = 1 - xi_M; 1 - z_M of "
        "eq. 3.5 likewise with b and m = xi_A (a form chosen here; loops of a usual shape lie within the full one)",
        sentence="When a stroke is broken off and turned round, the wire answers sooner than after a full stroke: its small loops "
        "are narrower than the large one.",
        switches=("heating_shift", "cooling_shift"),
        initial_guess={"heating_shift": 0.1, "cooling_shift": 0.1, "small": 0.5, "pinned": 0.5},
        grid=_grid,
        prior_class="material",
        widths={
            "heating_shift": Width(
                0.3,
                "minor loops of NiTi wires begin their way back earlier by up to a third of the range",
            ),
            "cooling_shift": Width(
                0.3,
                "minor loops of NiTi wires begin their way back earlier by up to a third of the range",
            ),
            "small": Width(0.3, "any share from 0 to 1 alike"),
            "pinned": Width(0.3, "any share from 0 to 1 alike"),
        },
    )

    def _earlier(self, size: Scalar, z: Scalar, amplitude: Scalar) -> Scalar:
        """z, from 0 at the start of a range to 1 at its end, in a loop that is `amplitude` of a full one."""
        missing = _missing(amplitude)
        # The largest m (1 - r m) of all loops: at m = 1, or at 1/(2 r) where that is within.
        within = self.small > 0.5
        largest = jnp.where(within, 0.25 / jnp.where(within, self.small, 0.5), 1.0 - self.small)
        early = size * missing * (1.0 - self.small * missing) / largest
        return z + early * (1.0 - self.pinned * z) / (1.0 + self.pinned * early)

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return self._earlier(self.heating_shift, z, old.xi_M)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return 1.0 - self._earlier(self.cooling_shift, 1.0 - z, 1.0 - old.xi_A)
