"""What the source leaves out of its rigs and controllers: one set of values for all of its figures.

`python -m studies.unprinted` finds them from what the text says and quotes of all figures that they enter, and keeps the
record (studies/unprinted). The product's presets are others: they are searched for settling time and overshoot.
"""

from __future__ import annotations

from smajax.control.controllers.backstepping_one import BacksteppingOne
from smajax.control.controllers.backstepping_two import BacksteppingTwo
from smajax.control.controllers.boundary_layer import AsPrinted
from smajax.control.controllers.stress_sliding import StressSliding
from smajax.control.controllers.vsc2 import Vsc2
from smajax.control.controllers.vsc3 import Vsc3
from smajax.control.presets import backstepping_one, backstepping_two, stress_sliding, vsc2, vsc3
from smajax.core.parameters import set_parameters
from smajax.model.system import System

# M11 to M14: amplifier, its largest current, heat loss and unevenness of the dead weight's wire (`uneven_wire`).
DEAD_WEIGHT = {
    "amplifier_gain": 1.792,  # -
    "largest_current": 1.145,  # A
    "unevenness": 0.35,  # -, standard deviation of the heat that a piece keeps, of its mean
    "convection_slope": 2e-3,  # 1/K, of h_c: h ~ (T - T_inf)^0.2, free convection of a thin wire; not fitted
}
# M5, M6, M8 and C11 to C13.
SLIDING = {
    "surface_slope": 4.87,  # 1/s
    "gain": 0.00306,  # N m
    "boundary": 0.788,  # rad/s
    "stress_gain": 7.48e-07,  # V/Pa
    "stress_integral_gain": 3.43e-06,  # V/(Pa s)
    "stress_derivative_gain": 6.13e-10,  # V s/Pa
}
# C4, C5 and C7: VSC3.
SURFACE = {
    "surface_slope": 1.99,  # 1/s
    "boundary": 0.0671,  # rad/s
    "rate_filter": 0.0875,  # s
}
HIGH_VOLTAGE = 10.0  # V, sec. 4.4.4: "according to the hardware restrictions", and so for every controller
# C4: VSC2, with u = K s inside its layer as eq. 4.5 prints it. Nothing of it is chosen for C4: the layer is VSC3's, which at rest
# is phi / lambda of the angle, and K is what meets V_high at its edge, s = -phi.
LAYER_WIDTH = SURFACE["boundary"] / SURFACE["surface_slope"]
LAYER = {
    "boundary": LAYER_WIDTH,  # rad
    "layer_gain": -HIGH_VOLTAGE / LAYER_WIDTH,  # V/rad
}
# C15 to C22; C16, C17 and C22 sweep one of the two.
BACKSTEPPING = {
    "damping_gain": 1.2,  # 1/s, K
    "temperature_gain": 30.0,  # 1/s, K_1
}


def sliding(system: System) -> StressSliding:
    """Stress-based sliding control (sec. 4.7)."""
    return set_parameters(stress_sliding(system), SLIDING | {"largest_voltage": HIGH_VOLTAGE})


def switch_with_a_layer(system: System) -> Vsc2:
    """VSC2 (sec. 4.4.2) as printed."""
    usual = vsc2(system)
    layer = AsPrinted(layer_gain=LAYER["layer_gain"])
    return Vsc2(usual.high_voltage, usual.low_voltage, LAYER["boundary"], layer)


def switch_on_a_surface(system: System) -> Vsc3:
    """VSC3 (sec. 4.4.3)."""
    return set_parameters(vsc3(system), SURFACE)


def backstepping(system: System) -> BacksteppingTwo:
    """Backstepping, approach II (sec. 4.8.2)."""
    return set_parameters(backstepping_searched(system), BACKSTEPPING)


def backstepping_searched(system: System) -> BacksteppingTwo:
    """The same with the preset's gains, which are searched for settling."""
    return set_parameters(backstepping_two(system), {"largest_voltage": HIGH_VOLTAGE})


def backstepping_by_stress(system: System) -> BacksteppingOne:
    """Backstepping, approach I (sec. 4.8.1), with the preset's gains."""
    return set_parameters(backstepping_one(system), {"largest_voltage": HIGH_VOLTAGE})
