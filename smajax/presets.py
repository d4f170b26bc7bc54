"""Rigs of the source and of the measured data, each with its table; SI, temperatures in C.

A preset is a function without arguments that returns a part of a `System`. What the source prints wrongly or leaves
out is said beside the number.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from smajax.controller.backstepping_one import BacksteppingOne
from smajax.controller.backstepping_two import BacksteppingTwo
from smajax.controller.base import AbstractController
from smajax.controller.pid import Pid
from smajax.controller.stress_sliding import StressSliding
from smajax.controller.temperature_vsc import Passing, TemperatureVsc
from smajax.controller.vsc1 import Vsc1
from smajax.controller.vsc2 import Vsc2
from smajax.controller.vsc3 import Vsc3
from smajax.drive.base import AbstractDrive
from smajax.drive.current import Current
from smajax.drive.duty import Duty
from smajax.drive.none import NoDrive
from smajax.drive.power import Power
from smajax.drive.voltage import Voltage
from smajax.estimator.model_filter import ModelFilter
from smajax.estimator.printed_filter import PrintedFilter
from smajax.load.arm import Arm
from smajax.load.base import AbstractMovingLoad
from smajax.load.bias_spring import BiasSpring
from smajax.load.coupon import AbstractCoupon, Coupon, StrainCoupon
from smajax.load.dead_weight import DeadWeight
from smajax.parameters import set_parameters
from smajax.system import System
from smajax.wire.conditions import Enhanced
from smajax.wire.constitutive import Constitutive
from smajax.wire.heat import Heat, cross_section
from smajax.wire.kinetics import Kinetics
from smajax.wire.resistance import Resistance
from smajax.wire.wire import Wire


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
    """No amplifier, and no limit that a bench would meet."""
    return Voltage(amplifier_gain=1.0, amplifier_limit=1e3)


def amplified_voltage() -> Voltage:
    """The arm's amplifier: 2 in the source's reading of eq. 4.28 (V^2/R with the R of one metre), so 2 l_0 here."""
    return Voltage(amplifier_gain=1.8, amplifier_limit=1e3)


def flexinol_voltage() -> Voltage:
    """The dead weight's amplifier ("amplified before being applied", sec. 3.5): 1.6 puts the onset just above 4 V (M11)."""
    return Voltage(amplifier_gain=1.6, amplifier_limit=1e3)


def duty() -> Duty:
    """A 25 V supply switched by a duty cycle."""
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
LOADS: dict[str, Callable[[], AbstractMovingLoad | AbstractCoupon]] = {
    "dead_weight": dead_weight,
    "bias_spring": bias_spring,
    "arm": arm,
    "coupon": Coupon,
    "strain_coupon": StrainCoupon,
}
DRIVES: dict[str, Callable[[], AbstractDrive]] = {
    "voltage": voltage,
    "amplified_voltage": amplified_voltage,
    "flexinol_voltage": flexinol_voltage,
    "current": Current,
    "power": Power,
    "duty": duty,
    "none": NoDrive,
}


def _needs_arm(system: System, control: str) -> Arm:
    if not isinstance(system.load, Arm):
        raise ValueError(f"{control} control is derived for the arm, not for {type(system.load).__name__}.")
    return system.load


def stress_sliding(system: System) -> StressSliding:
    """Stress-based sliding control of the arm (sec. 4.7) as chapter 3 uses it; the source prints no gains.

    Slow enough that the loading below the angle of greatest stress stays simple (M8).
    """
    return StressSliding(
        arm=_needs_arm(system, "stress-based sliding"),
        cross_section=cross_section(system.wire),
        surface_slope=3.0,
        gain=8.5e-3,
        boundary=4.0,
        stress_gain=2.5e-7,
        stress_integral_gain=2.5e-7,
        stress_derivative_gain=0.0,
        largest_voltage=8.7,
    )


def quick_stress_sliding(system: System) -> StressSliding:
    """The same for chapter 4; gains: studies/gains/stress_sliding.json.

    A preset of its own: with these gains the stress rises and falls within a step to a set point, and the laws, which
    M8 finds agreeing, come 6 degrees apart.
    """
    quick = {
        "surface_slope": 16.2,
        "gain": 6.67e-3,
        "boundary": 0.783,
        "stress_gain": 5.21e-7,
        "stress_integral_gain": 3.71e-6,
        "stress_derivative_gain": 8.35e-10,
    }
    return set_parameters(stress_sliding(system), quick)


def backstepping_one(system: System) -> BacksteppingOne:
    """Backstepping, approach I (sec. 4.8.1), that knows its plant; gains: studies/gains/backstepping_one.json."""
    _needs_arm(system, "backstepping")
    return BacksteppingOne(believed=system, damping_gain=1.76, stress_gain=121.0, largest_voltage=8.7)


def backstepping_two(system: System) -> BacksteppingTwo:
    """Backstepping, approach II (sec. 4.8.2), that knows its plant; gains: studies/gains/backstepping_two.json."""
    _needs_arm(system, "backstepping")
    return BacksteppingTwo(believed=system, damping_gain=1.67, temperature_gain=99.3, largest_voltage=8.7)


# By the set point at which they were tuned, deg: studies/gains/pid.json, `tuned_at_...`.
PID_TUNED_AT: dict[int, dict[str, float]] = {
    0: {"proportional_gain": 19.2, "integral_gain": 8.56, "derivative_gain": 1.85},
    10: {"proportional_gain": 16.4, "integral_gain": 6.08, "derivative_gain": 5.39},
    40: {"proportional_gain": 10.8, "integral_gain": 3.69, "derivative_gain": 3.52},
}


def pid(system: System) -> Pid:
    """PID with anti-windup for the whole range of the arm: studies/gains/pid.json, `tuned_everywhere`."""
    return Pid(
        proportional_gain=21.0, integral_gain=36.8, derivative_gain=2.61, largest_voltage=10.0, unwinding_time=0.02
    )


def pid_tuned_at(system: System, degrees: int) -> Pid:
    """PID without anti-windup, which the source does not name, tuned at 0, 10 or 40 deg only (Fig. 4.3-4.5)."""
    if degrees not in PID_TUNED_AT:
        raise ValueError(f"PID gains were searched at {sorted(PID_TUNED_AT)} deg, not at {degrees}.")
    return Pid(**PID_TUNED_AT[degrees], largest_voltage=10.0, unwinding_time=1e9)


def vsc1(system: System) -> Vsc1:
    """Simple switch; 10 V and 4 V as printed (sec. 4.4.4)."""
    return Vsc1(high_voltage=10.0, low_voltage=4.0)


def vsc2(system: System) -> Vsc2:
    """Switch with a layer that settles as nearly in the printed 8 s as any does: studies/gains/vsc.json, `vsc2`."""
    return Vsc2(high_voltage=10.0, low_voltage=4.0, boundary=0.01)


def vsc3(system: System) -> Vsc3:
    """Modified switch that settles in the printed 3 s at 0 deg: studies/gains/vsc.json, `vsc3`."""
    return Vsc3(high_voltage=10.0, low_voltage=4.0, surface_slope=0.945, boundary=0.116, rate_filter=0.02)


def vsc3_of_section_4_6(system: System) -> Vsc3:
    """The quicker VSC that overshoots at 50 deg up to A_f', as Fig. 4.14a: studies/gains/vsc.json, `vsc3_of_section_4_6`."""
    return Vsc3(high_voltage=10.0, low_voltage=4.0, surface_slope=12.7, boundary=0.901, rate_filter=0.02)


def temperature_vsc(system: System) -> TemperatureVsc:
    """NVSC around the VSC of section 4.6, which knows its wire: studies/gains/temperature_vsc.json."""
    load, law = system.load, system.wire.kinetics
    if not isinstance(load, Arm):
        raise ValueError(f"temperature-based VSC is for the arm, not for {type(load).__name__}.")
    # All austenite: the arm has gone the whole recoverable strain.
    stroke = system.wire.constitutive.recoverable_strain / load.contraction(system.wire)
    return TemperatureVsc(
        vsc=vsc3_of_section_4_6(system),
        band=Passing(passing_speed=3.67),
        temperature_band=385.0,
        temperature_gain=2.18,
        finish_filter=0.02,
        finish_temperature=law.austenite_finish,
        stress_slope=law.stress_slope_austenite,
        finish_position=load.start_angle + stroke,
    )


# Name on the command line -> (preset, its main gain, which a sweep varies).
CONTROLLERS: dict[str, tuple[Callable[[System], AbstractController], str]] = {
    "pid": (pid, "proportional_gain"),
    "vsc1": (vsc1, "high_voltage"),
    "vsc2": (vsc2, "boundary"),
    "vsc3": (vsc3, "surface_slope"),
    "nvsc": (temperature_vsc, "temperature_gain"),
    "sld": (quick_stress_sliding, "surface_slope"),
    "backstepping1": (backstepping_one, "damping_gain"),
    "backstepping2": (backstepping_two, "damping_gain"),
}


def printed_filter(system: System) -> PrintedFilter:
    """The source's filter of the arm (sec. 4.5), first guess, P_0 and Q as printed.

    R is not printed; here it equals Q. On readings with 1e-3 rad of noise that R gives the least error of the stress of
    those tried (studies/estimators.py); a smaller one lets the noise, differenced twice, through.
    """
    _needs_arm(system, "the printed filter")
    return PrintedFilter(
        system=system,
        reading_variance=1e-2,
        process_variance=1e-2,
        start_variance=1.0,
        start_stress=98.1e6,
        start_temperature=20.0,
    )


def model_filter(system: System) -> ModelFilter:
    """Kalman filter over the simulator's own step; lengths as strains of the wire, so that they fit any moving load.

    The walks are the smallest of those tried (studies/estimators.py) with which the innovations are as large as the
    filter expects (squared 0.7 to 1.2 of their variance) also where the believed h_c is 10 %, the payload 5 % or A_s and
    A_f 2 C wrong; 3 C of ambient temperature still make them 4.5.
    """
    if not isinstance(system.load, AbstractMovingLoad):
        raise ValueError(f"the filter needs a load that moves, and {type(system.load).__name__} does not.")
    per_strain = 1.0 / system.load.contraction(system.wire)  # 55 rad for the arm
    return ModelFilter(
        system=system,
        reading_noise=2e-5 * per_strain,
        position_walk=2e-6 * per_strain,
        velocity_walk=2e-3 * per_strain,
        temperature_walk=1.0,
        fraction_walk=1e-2,
        start_temperature=system.wire.heat.ambient_temperature,
        start_position_error=2e-5 * per_strain,
        start_velocity_error=2e-4 * per_strain,
        start_temperature_error=2.0,
        start_fraction_error=1e-3,
    )


def build(wire: str, load: str, drive: str) -> System:
    """A system by preset names; KeyError lists the names there are."""
    for kind, name, table in (("wire", wire, WIRES), ("load", load, LOADS), ("drive", drive, DRIVES)):
        if name not in table:
            raise KeyError(f"No {kind} preset `{name}`; there are {sorted(table)}.")
    return System(WIRES[wire](), LOADS[load](), DRIVES[drive]())
