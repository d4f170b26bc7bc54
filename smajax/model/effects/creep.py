"""Retarded elasticity: one Kelvin element in series with the wire, so it creeps and relaxes."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, time_constants
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.history import DURATION, HistoryTerm, following
from smajax.model.wire.wire import Wire

RETARDED = "retarded_strain"


class Creep(AbstractEffect, HistoryTerm, ConstitutiveTerm):
    r"""$\varepsilon \mathrel{+}= \varepsilon_v$ with $\tau \dot\varepsilon_v + \varepsilon_v = [J_A + (J_M - J_A) \xi] \sigma$ (Kelvin).

    Under a held stress the strain creeps on after a change of stress or of phase: martensite, the softer phase, creeps
    more. Under a held strain the stress relaxes. A run begins at rest.
    """

    austenite: Scalar = parameter(
        "1/Pa", 0.0, 5e-10, "J_A: retarded strain per stress; 1/E is 1.3e-11 to 3.6e-11", default=0.0
    )
    martensite: Scalar = parameter("1/Pa", 0.0, 5e-10, "J_M", default=0.0)
    time_constant: Scalar = parameter("s", 0.1, 1e4, "tau: retardation time", default=5.0)

    effect_name: ClassVar[str] = "creep"
    candidate: ClassVar[Candidate] = Candidate(
        title="creep and relaxation",
        equation="constitutive",
        formula="strain += eps_v, tau deps_v/dt + eps_v = [J_A + (J_M - J_A) xi] sigma (Kelvin element in series)",
        sentence="After a change of load or of phase the wire goes on stretching (or shortening) for a while although neither load "
        "nor temperature changes any more.",
        switches=("austenite", "martensite"),
        initial_guess={"austenite": 5e-12, "martensite": 5e-12, "time_constant": 5.0},
        needs_time=True,
        grid=time_constants(0.01, 0.05, 0.2),
        prior_class="bench",
        widths={
            "austenite": Width(
                5e-12,
                "NiTi at rest creeps by a few per cent up to a third of its elastic strain, 1/E_A = 1.3e-11 1/Pa (Table 3.2)",
            ),
            "martensite": Width(
                1e-11,
                "NiTi at rest creeps by a few per cent up to a third of its elastic strain, 1/E_M = 3.6e-11 1/Pa (Table 3.2)",
            ),
            "time_constant": Width(1.5, "creep after a step of load: from a second to a minute", logarithmic=True),
        },
    )

    def _settled(self, at: WireState) -> Scalar:
        return (self.austenite + (self.martensite - self.austenite) * at.martensite_fraction) * at.stress

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {RETARDED: self._settled(at), DURATION: jnp.zeros_like(at.stress)}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        return {RETARDED: following(old, RETARDED, self._settled(old), self._settled(new), self.time_constant)}

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return at.history[RETARDED]
