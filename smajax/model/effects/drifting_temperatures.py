"""Transformation temperatures that drift from cycle to cycle (functional fatigue)."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.history import TRANSFORMED, HistoryTerm, transformed
from smajax.model.wire.kinetics import cooling_width, heating_width
from smajax.model.wire.kinetics_terms import RangeTerm
from smajax.model.wire.wire import Kinetics


class DriftingTemperatures(AbstractEffect, HistoryTerm, RangeTerm):
    r"""$A_s, A_f \mathrel{+}= a N_0 (1 - e^{-N/N_0})$ and $M_s, M_f \mathrel{+}= b N_0 (1 - e^{-N/N_0})$, $N = \frac12 \int |d\xi|$.

    N counts full cycles from the start of a run, whatever their size: two half strokes are one. A run of few cycles tells a, and not what comes after many, a N_0.
    """

    first_heating: Scalar = parameter("K", -20.0, 20.0, "a: shift of A_s and A_f per cycle at the start", default=0.0)
    first_cooling: Scalar = parameter("K", -20.0, 20.0, "b: shift of M_s and M_f per cycle at the start", default=0.0)
    cycles: Scalar = parameter("-", 0.5, 1e4, "N_0: cycles after which 63 % of it is done", default=5.0)

    effect_name: ClassVar[str] = "drifting_temperatures"
    moves_within_step: ClassVar[bool] = True
    candidate: ClassVar[Candidate] = Candidate(
        title="transformation temperatures drifting with cycles",
        equation="kinetics",
        formula="A_s, A_f += a N_0 [1 - exp(-N/N_0)] and M_s, M_f += b N_0 [1 - exp(-N/N_0)], N = (1/2) int |dxi| (usual form of "
        "functional fatigue: exponential towards a stable cycle)",
        sentence="The wire is not yet trained: from cycle to cycle it transforms at other temperatures, ever less so.",
        switches=("first_heating", "first_cooling"),
        initial_guess={"first_heating": 0.2, "first_cooling": 0.2, "cycles": 5.0},
        prior_class="bench",
        widths={
            "first_heating": Width(1.5, "functional fatigue of NiTi: A_s and A_f move by up to 10 K in some cycles"),
            "first_cooling": Width(1.5, "functional fatigue of NiTi: M_s and M_f move by 5 to 20 K in some cycles"),
            "cycles": Width(1.2, "shakedown of NiTi wires: a few to some tens of cycles", logarithmic=True),
        },
    )

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {TRANSFORMED: jnp.zeros_like(at.stress)}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        return transformed(old, new)

    def _done(self, old: WireState) -> Scalar:
        return -self.cycles * jnp.expm1(-0.5 * old.history[TRANSFORMED] / self.cycles)

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.first_heating * self._done(old) / heating_width(law)

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        return z - self.first_cooling * self._done(old) / cooling_width(law)
