"""Surroundings that warm up with the wire: a sleeve or a tube around it, the air of a box."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Candidate, Width, time_constants
from smajax.model.types import Scalar, WireState
from smajax.model.wire.heat import HeatState, HeatTerm, convection
from smajax.model.wire.history import DURATION, HistoryTerm, following
from smajax.model.wire.wire import Wire

LATE = "late_temperature"  # C, of the wire, as its surroundings have it


class WarmedSurroundings(AbstractEffect, HeatTerm, HistoryTerm):
    r"""$h_c A_c (T - T_s)$ in the place of $h_c A_c (T - T_\infty)$, with $T_s = T_\infty + w\,(T_l - T_\infty)$ and $\tau \dot T_l + T_l = T$.

    A second thermal mass between wire and air: of what the wire is above the air its surroundings come to the share w, a time constant late.
    With conductances $G_1$ from the wire to them and $G_2$ from them to the air $w = G_1/(G_1 + G_2)$ and $\tau = m c/(G_1 + G_2)$ (heat balance of the
    second mass, in air of constant temperature: a change of the air's they follow at once). Effects that change the convection change what the wire loses to the air. A run begins with surroundings as warm as they would be for long beside the wire as it is.
    """

    share: Scalar = parameter(
        "-", 0.0, 0.95, "w: of the wire's excess over the air, what its surroundings come to", default=0.0
    )
    time_constant: Scalar = parameter("s", 0.1, 1e3, "tau: time in which they warm up and cool", default=10.0)

    effect_name: ClassVar[str] = "warmed_surroundings"
    candidate: ClassVar[Candidate] = Candidate(
        title="surroundings that warm up",
        equation="heat",
        formula="h_c A_c (T - T_s) in eq. 3.1, T_s = T_inf + w (T_l - T_inf), tau dT_l/dt + T_l = T (heat balance of a second mass)",
        sentence="What is around the wire, a sleeve or the air of a box, warms up with it: the longer the wire is hot the less heat it loses, "
        "and it cools slowly after that.",
        switches=("share",),
        initial_guess={"share": 0.1, "time_constant": 10.0},
        needs_time=True,
        grid=time_constants(0.02, 0.1, 0.4),
        prior_class="bench",
        widths={
            "share": Width(0.2, "air of a box to a close sleeve: 0.05 to 0.5"),
            "time_constant": Width(
                1.0, "m c/G of tubes and sleeves of plastic, 0.2 to 1 mm thick: 5 to 40 s", logarithmic=True
            ),
        },
    )

    def history_at_start(self, at: WireState) -> dict[str, Scalar]:
        return {LATE: at.temperature, DURATION: jnp.zeros_like(at.temperature)}

    def _late(self, old: WireState, temperature: Scalar) -> Scalar:
        """T_l at the end of a step from `old`, C."""
        return following(old, LATE, old.temperature, temperature, self.time_constant)

    def history_after(self, old: WireState, new: WireState) -> dict[str, Scalar]:
        return {LATE: self._late(old, new.temperature)}

    def heat_loss(self, wire: Wire, at: HeatState) -> Scalar | float:
        return -self.share * convection(wire, self._late(at.old, at.temperature), at.ambient)
