"""VSC2: the switch of VSC1 with a boundary layer (Elahinia 2004, eq. 4.5)."""

from __future__ import annotations

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.boundary_layer import AbstractLayer, Continuous
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class Vsc2(AbstractController):
    r"""$s = \theta - \theta_d$, with a layer of half thickness phi around s = 0 (`boundary_layer`)."""

    high_voltage: Scalar = parameter("V", 0.0, 1e4, "V_high: short of the layer", limits_command=True)
    low_voltage: Scalar = parameter("V", 0.0, 1e4, "V_low: beyond it")
    boundary: Scalar = parameter("rad", 1e-6, 1e3, "phi: half thickness of the layer")
    layer: AbstractLayer = Continuous()

    def start(self, measured: MeasuredState, wanted: Reference) -> tuple[()]:
        return ()

    def step(
        self, memory: tuple[()], measured: MeasuredState, wanted: Reference, period: Scalar
    ) -> tuple[tuple[()], Scalar]:
        surface = measured.position - wanted.position
        return memory, self.layer.voltage(surface, self.boundary, self.high_voltage, self.low_voltage)
