"""Specific heat that differs between the phases."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Extent, Width
from smajax.model.types import Scalar
from smajax.model.wire.heat import HeatState, HeatTerm, mass_per_metre
from smajax.model.wire.wire import Wire

# a k beyond which Kirchhoff's change of the latent heat alone, far from T_0, would turn a transformation into a jump.
MOST_KIRCHHOFF = 0.3


def _grid(extent: Extent) -> tuple[dict[str, float], ...]:
    return ({"kirchhoff": 0.05},)  # a little inside: at its bound it has one side only


class PhaseSpecificHeat(AbstractEffect, HeatTerm):
    r"""$c_p = c_p^M [1 + a (1 - \xi)]$; the heat of transformation follows by Kirchhoff's law, or by a share k of it.

    With k = 1 heat is a function of the state, $m c_p^M a (1 - \xi)(T - T_0)$ beside the base model's, and the heat of
    transformation changes with temperature; it is that of the base model at $T_0 = (M_s + A_f)/2$ (Tong and Wayman 1974).
    With k = 0 it stays that of the base model at any temperature: $m c_p(\xi) \dot T$ in eq. 3.1 and no more, as a specific
    heat of each phase and one latent heat are commonly put together; heat is then no function of the state. Where a > 0.3, the share that
    counts is 0.3 k/a: with more, the heat of transformation would turn a transformation far from T_0 into a jump.
    """

    contrast: Scalar = parameter("-", -0.3, 1.0, "a: relative change of c_p from martensite to austenite", default=0.0)
    kirchhoff: Scalar = parameter(
        "-", 0.0, 1.0, "k: share of Kirchhoff's change of the heat of transformation", default=1.0
    )

    effect_name: ClassVar[str] = "phase_specific_heat"
    candidate: ClassVar[Candidate] = Candidate(
        title="specific heat depending on the phase",
        equation="heat",
        formula="m c_p {[1 + a (1 - xi)] dT/dt - k a (T - T_0) dxi/dt} in eq. 3.1, T_0 = (M_s + A_f)/2 (Kirchhoff; T_0 after Tong and "
        "Wayman 1974)",
        sentence="A hot wire takes more (or less) heat a degree than a cold one: it warms up and cools down at another pace "
        "after its transformation than before, and rests at the same temperature.",
        switches=("contrast",),
        initial_guess={"contrast": 0.05, "kirchhoff": 0.95},
        grid=_grid,
        prior_class="material",
        widths={
            "contrast": Width(0.1, "calorimetry of NiTi: both phases within 10 % of each other"),
            "kirchhoff": Width(0.5, "any share from 0 to 1"),
        },
    )

    def _share(self) -> Scalar:
        """Of Kirchhoff's change that counts."""
        return self.kirchhoff * (MOST_KIRCHHOFF / jnp.maximum(self.contrast, MOST_KIRCHHOFF))

    def stored_heat(self, wire: Wire, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        law = wire.kinetics
        beyond = temperature - 0.5 * (law.martensite_start + law.austenite_finish)
        return self._share() * self._more(wire) * (1.0 - fraction) * beyond

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        # A capacity, and not the difference of a stored heat and a heat of transformation: in the stages of a step these weigh differently,
        # and of a large contrast what is left between them would turn a transformation into a jump.
        austenite = 1.0 - 0.5 * (at.fraction + at.old.martensite_fraction)
        return (
            (1.0 - self._share()) * self._more(wire) * austenite * (at.temperature - at.old.temperature) / at.duration
        )

    def _more(self, wire: Wire) -> Scalar:
        """Heat capacity of austenite over martensite's, J/(K m)."""
        return mass_per_metre(wire) * wire.heat.specific_heat * self.contrast
