"""Recoverable strain that grows with stress: a low stress orients only part of the martensite."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width, several_forces
from smajax.model.types import Scalar, WireState
from smajax.model.wire.constitutive import ConstitutiveTerm
from smajax.model.wire.history import HistoryTerm
from smajax.model.wire.wire import Wire

BY_STRESS, AS_FORMED = "strain_by_stress", "strain_as_formed"


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    # A little inside: at its bound a share has one side only.
    return ({"returned": 0.05}, {"returned": 0.95})


class StressDependentStrain(AbstractEffect, HistoryTerm, ConstitutiveTerm):
    r"""$\varepsilon = b\,\varepsilon_f + (1 - b)\,\varepsilon_r$, $\dot\varepsilon_r = H\dot\xi$; $\dot\varepsilon_f = H\dot\xi$ forming, $\varepsilon_f\dot\xi/\xi$ going.

    $H = g [1 - e^{-\sigma/\sigma_k}]$. Martensite that is there keeps its strain when the stress changes. With b = 1 it
    gives back what it formed with (Lagoudas et al. 2012, forward and reverse transformation), with b = 0 what the stress
    of that moment asks for: eq. 3.2 in rate form with an eps_L that depends on stress, in which cycles that form under one
    stress and go under another leave strain behind. Under a constant stress the two are one. A run begins with what its
    first stress orients.
    """

    # Not negative: a strain that falls with stress faster than the elastic one rises is no material.
    gain: Scalar = parameter("-", 0.0, 0.06, "g: recoverable strain added at high stress", default=0.0)
    scale: Scalar = parameter("Pa", 1e7, 6e8, "sigma_k: stress over which it grows", default=100000000.0)

    returned: Scalar = parameter(
        "-", 0.0, 1.0, "b: 1 where martensite gives back the strain it formed with", default=0.5
    )

    effect_name: ClassVar[str] = "stress_dependent_strain"
    candidate: ClassVar[Candidate] = Candidate(
        title="recoverable strain depending on stress",
        equation="constitutive",
        formula="eps_L(sigma) = eps_L + g [1 - exp(-sigma/sigma_k)] per fraction that forms or goes; the share b of it goes as it "
        "formed (Lagoudas et al. 2012, H^cur)",
        sentence="A higher stress orients more of the martensite, so the stroke between cold and hot is longer under a "
        "heavier load.",
        switches=("gain",),
        initial_guess={"gain": 0.01, "scale": 1e8, "returned": 0.5},
        grid=_grid,
        observable=several_forces,
        prior_class="material",
        widths={
            "gain": Width(0.02, "NiTi: 1 to 4 % more strain from low to high stress"),
            "scale": Width(0.7, "NiTi: 50 to 200 MPa", logarithmic=True),
            "returned": Width(0.3, "any share from 0 to 1"),
        },
    )

    def _of(self, stress: Scalar) -> Scalar:
        # A solver may try a negative stress, of which the exponential knows no end.
        return self.gain * (1.0 - jnp.exp(-jnp.where(stress < 0.0, 0.0, stress) / self.scale))

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        oriented = self._of(at.stress) * at.martensite_fraction
        return {BY_STRESS: oriented, AS_FORMED: oriented}

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        before, formed = old.martensite_fraction, old.history[AS_FORMED]
        change = new.martensite_fraction - before
        by_stress = 0.5 * (self._of(old.stress) + self._of(new.stress)) * change
        given_back = formed * change / jnp.where(before > 0.0, before, 1.0)
        return {
            BY_STRESS: old.history[BY_STRESS] + by_stress,
            AS_FORMED: formed + jnp.where(change < 0.0, given_back, by_stress),
        }

    def strain(self, wire: Wire, at: WireState) -> Scalar | float:
        return self.returned * at.history[AS_FORMED] + (1.0 - self.returned) * at.history[BY_STRESS]
