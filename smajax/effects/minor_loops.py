"""Minor loops: after a partial transformation the way back begins earlier."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.effects.base import AbstractEffect
from smajax.parameters import parameter
from smajax.types import Scalar, WireState

if TYPE_CHECKING:
    from smajax.wire.kinetics import Kinetics


def _missing(amplitude: Scalar) -> Scalar:
    return jnp.where(amplitude > 1.0, 0.0, jnp.where(amplitude < 0.0, 1.0, 1.0 - amplitude))


class MinorLoops(AbstractEffect):
    r"""$z_A \to z_A + a (1 - \xi_M)$, $z_M \to z_M - b \xi_A$: a smaller loop starts its way back earlier by a share of the range.

    xi_M and xi_A of eq. 3.26 are the fraction at the reversal: 1 and 0 in a full cycle, which this leaves as it is. The
    printed model begins every way back at A_s' or M_s', however little of the wire had transformed.
    """

    heating: Scalar = parameter("-", -1.0, 2.0, "a: earlier start of heating in a small loop, in transformation ranges")
    cooling: Scalar = parameter("-", -1.0, 2.0, "b: earlier start of cooling in a small loop, in transformation ranges")

    effect_name: ClassVar[str] = "minor_loops"
    title: ClassVar[str] = "way back in minor loops"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "z_A + a (1 - xi_M) and z_M - b xi_A in eq. 3.3 and 3.5 (a linear form chosen here; loops of a usual shape lie "
        "within the full one)"
    )
    sentence: ClassVar[str] = (
        "When a stroke is broken off and turned round, the wire answers sooner than after a full stroke: its small loops "
        "are narrower than the large one."
    )
    switches: ClassVar[tuple[str, ...]] = ("heating", "cooling")
    starts: ClassVar[dict[str, float]] = {"heating": 0.1, "cooling": 0.1}

    @classmethod
    def base(cls) -> MinorLoops:
        return cls(heating=0.0, cooling=0.0)

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z + self.heating * _missing(old.xi_M)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.cooling * _missing(1.0 - old.xi_A)
