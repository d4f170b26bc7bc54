"""A voltage made by switching: what a meter shows is its mean, and a wire is heated by its mean square."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

if TYPE_CHECKING:
    from smajax.model.system import System


SUPPLY = 10.0  # V, height of the pulses; with another the losses and the heat capacity take up a factor


class PulsedVoltage(AbstractEffect):
    r"""$u^2 \to u^2 + w\,|u|\,(U_s - |u|)$: the mean square of pulses whose mean is u.

    Pulses from 0 to $U_s$ with the mean u have the variance $u (U_s - u)$; a filter or an inductance leaves the share w of
    it. U_s is taken as 10 V: of another supply the share is $w U_s/(w U_s + 10 (1 - w))$, and the convection and the heat
    capacity that are fitted come out smaller or larger by one factor.
    """

    share: Scalar = parameter("-", 0.0, 1.0, "w: share of the pulses' variance that reaches the wire")

    effect_name: ClassVar[str] = "pulsed_voltage"
    title: ClassVar[str] = "pulses recorded as their mean voltage"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = (
        "V^2 -> V^2 + w |V| (10 V - |V|) in I^2 R of eq. 3.1: mean square of pulses of mean V (variance of a pulse train)"
    )
    sentence: ClassVar[str] = (
        "The voltage comes in pulses and was recorded as their mean: small voltages heat the wire by more than their square."
    )
    switches: ClassVar[tuple[str, ...]] = ("share",)
    starts: ClassVar[dict[str, float]] = {"share": 0.05}

    @classmethod
    def base(cls) -> PulsedVoltage:
        return cls(share=0.0)

    @classmethod
    def applies(cls, system: System) -> bool:
        return "voltage" in system.drive.inputs_squared

    def command(self, channel: str, value: Scalar) -> Scalar:
        if channel != "voltage":
            return value
        size = jnp.abs(value)
        # As a factor, which is exactly one without a share; no voltage has no pulses.
        square = 1.0 + self.share * (SUPPLY / jnp.where(size > 0.0, size, SUPPLY) - 1.0)
        return value * jnp.sqrt(jnp.maximum(square, 1e-12))
