"""VSC3: the layer of VSC2 around a surface of position and velocity (Elahinia 2004, eq. 4.6)."""

from __future__ import annotations

from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.boundary_layer import AbstractLayer, Continuous
from smajax.control.controllers.rate import Rate, at_rest, filtered_rate
from smajax.control.measured_state import MeasuredState
from smajax.control.reference import Reference
from smajax.core.parameters import parameter
from smajax.model.types import Scalar


class Vsc3(AbstractController):
    r"""$s = \dot e + \lambda e$, $e = \theta - \theta_d$. It reads the position only: the velocity is a filtered difference."""

    high_voltage: Scalar = parameter("V", 0.0, 1e4, "V_high: short of the layer", limits_command=True)
    low_voltage: Scalar = parameter("V", 0.0, 1e4, "V_low: beyond it")
    surface_slope: Scalar = parameter("1/s", 0.0, 1e3, "lambda: how fast the error dies out on the surface")
    boundary: Scalar = parameter("rad/s", 1e-6, 1e3, "phi: half thickness of the layer")
    rate_filter: Scalar = parameter("s", 0.0, 10.0, "time constant of the velocity's filter")
    layer: AbstractLayer = Continuous()

    def start(self, measured: MeasuredState, wanted: Reference) -> Rate:
        return at_rest(measured.position)

    def step(self, memory: Rate, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Rate, Scalar]:
        moved = filtered_rate(memory, measured.position, self.rate_filter, period)
        error, rate = measured.position - wanted.position, moved.rate - wanted.velocity
        surface = rate + self.surface_slope * error
        return moved, self.layer.voltage(surface, self.boundary, self.high_voltage, self.low_voltage)
