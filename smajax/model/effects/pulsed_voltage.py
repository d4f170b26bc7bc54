"""A voltage made by switching: what a meter shows is its mean, and a wire is heated by its mean square."""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.drive.inputs import CommandTerm
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import Actuator, Candidate, Width
from smajax.model.types import Scalar

SUPPLY = 10.0  # V, height of the pulses; with another the losses and the heat capacity take up a factor


def _applies(system: Actuator) -> bool:
    return "voltage" in system.drive.inputs_squared


class PulsedVoltage(AbstractEffect, CommandTerm):
    r"""$u^2 \to u^2 + w\,|u|\,(U_s - |u|)$: the mean square of pulses whose mean is u.

    Pulses from 0 to $U_s$ with the mean u have the variance $u (U_s - u)$; a filter or an inductance leaves the share w of
    it. U_s is taken as 10 V: of another supply the share is $w U_s/(w U_s + 10 (1 - w))$, and the convection and the heat
    capacity that are fitted come out smaller or larger by one factor.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "w: share of the pulses' variance that reaches the wire", default=0.0)

    effect_name: ClassVar[str] = "pulsed_voltage"
    candidate: ClassVar[Candidate] = Candidate(
        title="pulses recorded as their mean voltage",
        equation="electrical",
        formula="V^2 -> V^2 + w |V| (10 V - |V|) in I^2 R of eq. 3.1: mean square of pulses of mean V (variance of a pulse train)",
        sentence="The voltage comes in pulses and was recorded as their mean: small voltages heat the wire by more than their square.",
        switches=("share",),
        initial_guess={"share": 0.05},
        applies=_applies,
        prior_class="bench",
        widths={
            "share": Width(0.3, "inductance and filters leave any share from 0 to 1"),
        },
    )

    def command(self, channel: str, value: Scalar) -> Scalar:
        if channel != "voltage":
            return value
        size = jnp.abs(value)
        # As a factor, which is exactly one without a share; no voltage has no pulses.
        square = 1.0 + self.share * (SUPPLY / jnp.where(size > 0.0, size, SUPPLY) - 1.0)
        return value * jnp.sqrt(jnp.maximum(square, 1e-12))
