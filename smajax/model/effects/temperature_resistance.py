"""Resistance that rises with temperature."""

from __future__ import annotations

from typing import ClassVar

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.types import Scalar

REFERENCE = 20.0  # C


class TemperatureResistance(AbstractEffect):
    r"""$R = R_{base} [1 + \alpha (T - 20)]$, the base resistivities being those at 20 C."""

    coefficient: Scalar = parameter("1/K", -1e-3, 5e-3, "alpha: temperature coefficient of the resistivity")

    effect_name: ClassVar[str] = "temperature_resistance"
    title: ClassVar[str] = "resistance depending on temperature"
    equation: ClassVar[str] = "electrical"
    formula: ClassVar[str] = "R = R_base [1 + alpha (T - 20 C)] (usual form of a metal, any electrical handbook)"
    sentence: ClassVar[str] = (
        "A hot wire conducts worse than a cold one in the same phase: at a given voltage it gets less power, and a "
        "measured resistance goes on rising where nothing transforms."
    )
    switches: ClassVar[tuple[str, ...]] = ("coefficient",)
    starts: ClassVar[dict[str, float]] = {"coefficient": 5e-4}

    @classmethod
    def base(cls) -> TemperatureResistance:
        return cls(coefficient=0.0)

    def resistance_factor(self, temperature: Scalar, fraction: Scalar) -> Scalar | float:
        return self.coefficient * (temperature - REFERENCE)
