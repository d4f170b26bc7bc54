"""Rigs of the source and of the measured data, each with its table; SI, temperatures in C.

A preset is a function without arguments that returns a part of a `System`. What the source prints wrongly or leaves
out is said beside the number.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

from smajax.core.names import close_matches
from smajax.core.parameters import set_parameters
from smajax.core.plugins import LOADS as PLUGGED
from smajax.core.plugins import PluginError, brought, points_of, resolved, whose
from smajax.model.drive.base import AbstractDrive
from smajax.model.drive.current import Current
from smajax.model.drive.duty import Duty
from smajax.model.drive.none import NoDrive
from smajax.model.drive.power import Power
from smajax.model.drive.voltage import Voltage
from smajax.model.load.arm import Arm
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.bias_spring import BiasSpring
from smajax.model.load.coupon import AbstractCoupon, Coupon, StrainCoupon
from smajax.model.load.dead_weight import DeadWeight
from smajax.model.system import System
from smajax.model.wire.conditions import Enhanced
from smajax.model.wire.laws import under_law
from smajax.model.wire.wire import Constitutive, Heat, Kinetics, Resistance, Wire


def niti_table_3_1() -> Wire:
    """Wire of the rotary arm, Elahinia 2004, Table 3.1. R, m and A_c are per metre, which the table does not say."""
    area = 0.25 * math.pi * 150e-6**2
    return Wire(
        wire_length=0.9,
        wire_diameter=150e-6,
        heat=Heat(density=1.14e-4 / area, specific_heat=837.0, convection_coefficient=150.0, ambient_temperature=20.0),
        resistance=Resistance(resistivity_austenite=45.0 * area, resistivity_martensite=45.0 * area),
        kinetics=Kinetics(
            austenite_start=68.0,
            austenite_finish=78.0,
            martensite_start=52.0,
            martensite_finish=42.0,
            stress_slope_austenite=10.3e6,
            stress_slope_martensite=10.3e6,
            conditions=Enhanced(),
        ),
        # eps_L: 2 r (135 deg)/l_0 = 0.043 is the printed stroke of the arm; with the printed 0.04 it ends at 81 deg, and
        # M5 and M6 need 85. theta_T as printed: positive, that is, a wire which shrinks on heating.
        constitutive=Constitutive(
            young_modulus_austenite=75e9,
            young_modulus_martensite=28e9,
            recoverable_strain=0.043,
            thermal_modulus=0.55e6,
        ),
    )


def flexinol_table_3_2() -> Wire:
    """Flexinol wire of the dead weight, Elahinia 2004, Table 3.2; h_c is not printed, 150 is Table 3.1's."""
    return Wire(
        wire_length=0.537,
        wire_diameter=150e-6,
        # 0.077 cal/(g C) = 322 J/(kg K).
        heat=Heat(density=6450.0, specific_heat=322.0, convection_coefficient=150.0, ambient_temperature=23.0),
        resistance=Resistance(resistivity_austenite=84e-8, resistivity_martensite=76e-8),
        kinetics=Kinetics(
            austenite_start=68.0,
            austenite_finish=78.0,
            martensite_start=52.0,
            martensite_finish=42.0,
            stress_slope_austenite=6.89e6,
            stress_slope_martensite=6.89e6,
            conditions=Enhanced(),
        ),
        # eps_L from the full stroke of 24.75 mm (eq. 3.22).
        constitutive=Constitutive(
            young_modulus_austenite=75e9,
            young_modulus_martensite=28e9,
            recoverable_strain=0.02475 / 0.537,
            thermal_modulus=0.55e6,
        ),
    )


def niti_table_3_1_expanding() -> Wire:
    """The wire of Table 3.1 with the physical sign of theta_T: it lengthens when heated."""
    return set_parameters(niti_table_3_1(), {"thermal_modulus": -0.55e6})


def flexinol_table_3_2_expanding() -> Wire:
    """The wire of Table 3.2 with the physical sign of theta_T: it lengthens when heated."""
    return set_parameters(flexinol_table_3_2(), {"thermal_modulus": -0.55e6})


def flexinol_ht_500um() -> Wire:
    """Flexinol HT wire, 0.5 mm: the maker's sheet (4.3 ohm/m), and the source's printed theta_T and moduli."""
    area = 0.25 * math.pi * 0.5e-3**2
    return Wire(
        wire_length=0.96,
        wire_diameter=0.5e-3,
        heat=Heat(density=6450.0, specific_heat=837.0, convection_coefficient=80.0, ambient_temperature=22.0),
        resistance=Resistance(resistivity_austenite=4.3 * area, resistivity_martensite=4.3 * area),
        kinetics=Kinetics(
            austenite_start=88.0,
            austenite_finish=98.0,
            martensite_start=72.0,
            martensite_finish=62.0,
            stress_slope_austenite=10.3e6,
            stress_slope_martensite=10.3e6,
            conditions=Enhanced(),
        ),
        constitutive=Constitutive(
            young_modulus_austenite=75e9, young_modulus_martensite=28e9, recoverable_strain=0.02, thermal_modulus=0.55e6
        ),
    )


def flexinol_isobaric() -> Wire:
    """Flexinol in an oven at constant stress: kinetics and constitutive law alone matter, the rest is nominal."""
    return Wire(
        wire_length=0.1,
        wire_diameter=0.5e-3,
        heat=Heat(density=6450.0, specific_heat=837.0, convection_coefficient=80.0, ambient_temperature=22.0),
        resistance=Resistance(resistivity_austenite=84e-8, resistivity_martensite=76e-8),
        kinetics=Kinetics(
            austenite_start=68.0,
            austenite_finish=78.0,
            martensite_start=52.0,
            martensite_finish=42.0,
            stress_slope_austenite=8e6,
            stress_slope_martensite=7.5e6,
            conditions=Enhanced(),
        ),
        constitutive=Constitutive(
            young_modulus_austenite=75e9, young_modulus_martensite=28e9, recoverable_strain=0.04, thermal_modulus=0.55e6
        ),
    )


def dead_weight() -> DeadWeight:
    """75 g (sec. 3.5); the damping is not printed: 20 N s/m settles a mass on this wire without ringing."""
    return DeadWeight(load_mass=0.075, damping=20.0)


def bias_spring() -> BiasSpring:
    """35 g slider on the teaching bench's spring; damping chosen to be critical or more."""
    return BiasSpring(slider_mass=0.035, damping=20.0, spring_stiffness=60.0, spring_preload=8.0)


def arm() -> Arm:
    """Rotary arm of Table 3.1. Geometry that the source omits, chosen once.

    The length makes the wire carry the printed sigma_0 = 75 MPa at -45 deg. The spring is slack there and pulls on a
    lever of 48 mm, about the link's own length: with it 7.2 V stops inside the range and 7.3 V passes the angle of
    greatest stress (M2, M3), and the wire stays taut to the top. The damping lets a swing die out in about a second.
    """
    return Arm(
        pulley_radius=8.25e-3,
        arm_length=0.04738,
        payload_mass=0.05719,
        link_mass=0.0187,
        spring_stiffness=3.871,
        spring_lever=0.048,
        spring_rest_angle=-math.pi / 4,
        damping=3e-3,
        start_angle=-math.pi / 4,
        lower_stop=-math.pi / 4,
        upper_stop=math.radians(95.0),
    )


def voltage() -> Voltage:
    """Voltage on the wire itself: no amplifier, and no limit that a bench would meet."""
    return Voltage(amplifier_gain=1.0, amplifier_limit=1e3)


def amplified_voltage() -> Voltage:
    """Voltage of the command, which the arm's amplifier puts on the wire 1.8 times.

    It is 2 in the source's reading of eq. 4.28 (V^2/R with the R of one metre), so 2 l_0 here.
    """
    return Voltage(amplifier_gain=1.8, amplifier_limit=1e3)


def flexinol_voltage() -> Voltage:
    """Voltage of the command, which the dead weight's amplifier puts on the wire 1.6 times.

    "Amplified before being applied" (sec. 3.5): 1.6 puts the onset just above 4 V (M11).
    """
    return Voltage(amplifier_gain=1.6, amplifier_limit=1e3)


def current() -> Current:
    """Current through the wire, of a controlled source."""
    return Current()


def power() -> Power:
    """Electrical power into the wire, of a controlled source."""
    return Power()


def undriven() -> NoDrive:
    """No heating: for a coupon, whose temperature is prescribed."""
    return NoDrive()


def duty() -> Duty:
    """Duty cycle, 0 to 1, of a switched supply of 25 V."""
    return Duty(supply_voltage=25.0)


WIRES: dict[str, Callable[[], Wire]] = {
    entry.__name__: entry
    for entry in (
        niti_table_3_1,
        niti_table_3_1_expanding,
        flexinol_table_3_2,
        flexinol_table_3_2_expanding,
        flexinol_ht_500um,
        flexinol_isobaric,
    )
}
# One in a file of its own, with its preset, is one line: "my_load": "smajax.model.load.my_load:my_load".
_LOADS: dict[str, Callable[[], AbstractMovingLoad | AbstractCoupon]] = resolved(
    {
        "dead_weight": dead_weight,
        "bias_spring": bias_spring,
        "blocked_wire": "smajax.model.load.blocked_wire:blocked_wire",
        "arm": arm,
        "coupon": Coupon,
        "strain_coupon": StrainCoupon,
    }
)


WANTED_LOAD = "expected a function without arguments that returns a load (`def my_load(): return MyLoad(...)`)"


def _wrong(name: str, load: Any) -> str:
    """What keeps a function of another package from being the preset of a load."""
    if not callable(load):
        return f"is {load!r}; {WANTED_LOAD}"
    try:
        inspect.signature(load).bind()
    except TypeError as error:
        what = f"the class {load.__name__}" if isinstance(load, type) else repr(load)
        return f"is {what}, which cannot be called without arguments ({error}); {WANTED_LOAD}"
    except ValueError:
        pass  # no signature to look at: it is seen when it is called
    return ""


def made_load(name: str) -> AbstractMovingLoad | AbstractCoupon:
    """The load of a preset. Raises PluginError where another package's function fails or returns something else."""
    if name in _LOADS:
        return _LOADS[name]()
    point = next((whose(one) for one in points_of(PLUGGED) if one.name == name), name)
    try:
        load = LOADS[name]()
    except Exception as error:
        raise PluginError(f"{point} fails when it is called ({error!r}); {WANTED_LOAD}.") from error
    if not isinstance(load, (AbstractMovingLoad, AbstractCoupon)):
        raise PluginError(f"{point} returns {load!r}; {WANTED_LOAD}.")
    return load


# Ours, then those of other packages (`smajax.core.plugins`); one is made when it is asked for.
LOADS: dict[str, Callable[[], AbstractMovingLoad | AbstractCoupon]] = {**_LOADS, **brought(PLUGGED, _LOADS, _wrong)}
DRIVES: dict[str, Callable[[], AbstractDrive]] = {
    "voltage": voltage,
    "amplified_voltage": amplified_voltage,
    "flexinol_voltage": flexinol_voltage,
    "current": current,
    "power": power,
    "duty": duty,
    "none": undriven,
}


def build(wire: str, load: str, drive: str, law: str = "") -> System:
    """A system by preset names, its wire under the named kinetics law or its own; KeyError lists the names there are."""
    for kind, name, table in (("wire", wire, WIRES), ("load", load, LOADS), ("drive", drive, DRIVES)):
        if name not in table:
            raise KeyError(f"No {kind} preset `{name}`{close_matches(name, sorted(table), 'there are')}.")
    made = WIRES[wire]()
    return System(under_law(made, law) if law else made, made_load(load), DRIVES[drive]())
