"""Residual strain that builds up with cycles (shakedown)."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.history import TRANSFORMED, HistoryTerm, transformed
from smajax.model.wire.wire import Wire


class ResidualStrain(AbstractEffect, HistoryTerm, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= \varepsilon_1 N_0 (1 - e^{-N/N_0})$, $N = \frac12 \int |d\xi|$ from the start of a run."""

    first: Scalar = parameter("-", 0.0, 0.02, "eps_1: residual strain of a cycle of the new wire", default=0.0)
    cycles: Scalar = parameter("-", 0.5, 1e4, "N_0: cycles after which a cycle leaves 37 % of that", default=5.0)

    effect_name: ClassVar[str] = "residual_strain"
    candidate: ClassVar[Candidate] = Candidate(
        title="residual strain growing with cycles",
        equation="constitutive",
        formula="strain += eps_1 N_0 [1 - exp(-N/N_0)], N = (1/2) int |dxi| (usual form of transformation-induced plasticity)",
        sentence="The wire gets a little longer with every cycle and does not come back: it needs cycles under its load before "
        "its stroke is repeatable.",
        switches=("first",),
        initial_guess={"first": 4e-4, "cycles": 5.0},
        prior_class="bench",
        widths={
            "first": Width(1e-3, "first cycle of an untrained NiTi wire under 100 to 200 MPa: 0.05 to 0.2 %"),
            "cycles": Width(1.2, "shakedown of NiTi wires: a few to some tens of cycles", logarithmic=True),
        },
    )

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {TRANSFORMED: jnp.zeros_like(at.stress)}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        return transformed(old, new)

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.first * self.cycles * (1.0 - jnp.exp(-0.5 * at.history[TRANSFORMED] / self.cycles))
