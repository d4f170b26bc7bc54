"""Transformation temperatures that drift from cycle to cycle (functional fatigue)."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import TRANSFORMED, transformed
from smajax.model.wire.kinetics import cooling_width, heating_width

if TYPE_CHECKING:
    from smajax.model.wire.kinetics import Kinetics


class DriftingTemperatures(AbstractEffect):
    r"""$A_s, A_f \mathrel{+}= a (1 - e^{-N/N_0})$ and $M_s, M_f \mathrel{+}= b (1 - e^{-N/N_0})$, $N = \frac12 \int |d\xi|$.

    N counts full cycles from the start of a run, whatever their size: two half strokes are one.
    """

    heating: Scalar = parameter("K", -40.0, 40.0, "a: shift of A_s and A_f after many cycles")
    cooling: Scalar = parameter("K", -40.0, 40.0, "b: shift of M_s and M_f after many cycles")
    cycles: Scalar = parameter("-", 0.5, 1e4, "N_0: cycles after which 63 % of it is done")

    effect_name: ClassVar[str] = "drifting_temperatures"
    title: ClassVar[str] = "transformation temperatures drifting with cycles"
    equation: ClassVar[str] = "kinetics"
    formula: ClassVar[str] = (
        "A_s, A_f += a [1 - exp(-N/N_0)] and M_s, M_f += b [1 - exp(-N/N_0)], N = (1/2) int |dxi| (usual form of "
        "functional fatigue: exponential towards a stable cycle)"
    )
    sentence: ClassVar[str] = (
        "The wire is not yet trained: from cycle to cycle it transforms at other temperatures, ever less so."
    )
    switches: ClassVar[tuple[str, ...]] = ("heating", "cooling")
    starts: ClassVar[dict[str, float]] = {"heating": 1.0, "cooling": 1.0, "cycles": 5.0}

    @classmethod
    def base(cls) -> DriftingTemperatures:
        return cls(heating=0.0, cooling=0.0, cycles=5.0)

    def kept_at_start(self, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return {TRANSFORMED: jnp.zeros_like(stress)}

    def kept_after(self, old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar) -> dict[str, Scalar]:
        return transformed(old, fraction)

    def _done(self, old: WireState) -> Scalar:
        return 1.0 - jnp.exp(-0.5 * old.kept[TRANSFORMED] / self.cycles)

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.heating * self._done(old) / heating_width(law)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.cooling * self._done(old) / cooling_width(law)
