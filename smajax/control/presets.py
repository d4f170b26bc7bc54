"""Controllers and filters with their gains of the arm, and how those were found.

A function here takes the system that the controller is to believe in, and gives the arm's gains whatever its load is:
`CONTROLLERS[name].make(system)` scales them to the load (`control.scales`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from smajax.control.controllers.backstepping_one import BacksteppingOne
from smajax.control.controllers.backstepping_two import BacksteppingTwo
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.pid import Pid
from smajax.control.controllers.preset import ANGLE, EQUATION, STATE, STROKE, Box, ControllerPreset
from smajax.control.controllers.stress_sliding import StressSliding
from smajax.control.controllers.temperature_vsc import Passing, TemperatureVsc
from smajax.control.controllers.vsc1 import Vsc1
from smajax.control.controllers.vsc2 import Vsc2
from smajax.control.controllers.vsc3 import Vsc3
from smajax.control.estimators.adaptive_filter import AdaptiveFilter
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.estimators.model_filter import ModelFilter
from smajax.control.estimators.printed_filter import PrintedFilter
from smajax.control.load_equation import equation_of, moving_load
from smajax.control.mismatch import mismatches_of
from smajax.control.scales import is_arm
from smajax.core.names import close_matches, listed
from smajax.core.parameters import set_parameters
from smajax.core.plugins import resolved
from smajax.core.provenance import code_mark
from smajax.core.units import parse_quantity
from smajax.model.load.arm import Arm
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.model.wire.form import IntegratedForm
from smajax.model.wire.heat import cross_section


def _needs_arm(system: System, control: str) -> Arm:
    if not isinstance(system.load, Arm):
        raise ValueError(
            f"{control} is derived for the arm, not for {type(system.load).__name__}: take the filter `model`, which goes with any "
            "moving load."
        )
    return system.load


def stress_sliding(system: System) -> StressSliding:
    """Stress-based sliding control (sec. 4.7) as chapter 3 uses it; the source prints no gains.

    Slow enough that the loading below the angle of greatest stress stays simple (M8).
    """
    return StressSliding(
        equation=equation_of(system),
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
    return BacksteppingOne(
        believed=system, damping_gain=1.76, stress_gain=121.0, largest_voltage=8.7, anchored=not is_arm(system)
    )


def backstepping_two(system: System) -> BacksteppingTwo:
    """Backstepping, approach II (sec. 4.8.2), that knows its plant; gains: studies/gains/backstepping_two.json."""
    return BacksteppingTwo(
        believed=system, damping_gain=1.67, temperature_gain=99.3, largest_voltage=8.7, anchored=not is_arm(system)
    )


# By the set point at which they were tuned, deg: studies/gains/pid.json, `tuned_at_...`.
PID_TUNED_AT: dict[int, dict[str, float]] = {
    0: {"proportional_gain": 50.6, "integral_gain": 9.16, "derivative_gain": 3.94},
    10: {"proportional_gain": 16.4, "integral_gain": 6.08, "derivative_gain": 5.39},
    40: {"proportional_gain": 10.8, "integral_gain": 3.69, "derivative_gain": 3.52},
}


def pid(system: System) -> Pid:
    """PID with anti-windup for the whole range of the arm: studies/gains/pid.json, `tuned_everywhere`."""
    return Pid(
        proportional_gain=12.8, integral_gain=9.72, derivative_gain=2.64, largest_voltage=10.0, unwinding_time=0.997
    )


def pid_tuned_at(system: System, degrees: int) -> Pid:
    """PID without anti-windup, which the source does not name, tuned at 0, 10 or 40 deg only (Fig. 4.3-4.5)."""
    if degrees not in PID_TUNED_AT:
        raise ValueError(f"PID gains were searched at {listed(map(str, sorted(PID_TUNED_AT)))} deg, not at {degrees}.")
    return Pid(**PID_TUNED_AT[degrees], largest_voltage=10.0, unwinding_time=1e9)


def vsc1(system: System) -> Vsc1:
    """Simple switch; 10 V and 4 V as printed (sec. 4.4.4)."""
    return Vsc1(high_voltage=10.0, low_voltage=4.0)


def vsc2(system: System) -> Vsc2:
    """Switch with a layer that settles as nearly in the printed 8 s as any does: studies/gains/vsc.json, `vsc2`."""
    return Vsc2(high_voltage=10.0, low_voltage=4.0, boundary=0.01)


def vsc3(system: System) -> Vsc3:
    """Modified switch that settles in the printed 3 s at 0 deg: studies/gains/vsc.json, `vsc3`."""
    return Vsc3(high_voltage=10.0, low_voltage=4.0, surface_slope=0.927, boundary=0.112, rate_filter=0.02)


def vsc3_of_section_4_6(system: System) -> Vsc3:
    """The quicker VSC that overshoots at 50 deg up to A_f', as Fig. 4.14a: studies/gains/vsc.json, `vsc3_of_section_4_6`."""
    return Vsc3(high_voltage=10.0, low_voltage=4.0, surface_slope=12.7, boundary=0.901, rate_filter=0.02)


def temperature_vsc(system: System) -> TemperatureVsc:
    """NVSC around the VSC of section 4.6, which knows its wire: studies/gains/temperature_vsc.json."""
    load, law = moving_load(system), system.wire.kinetics
    # All austenite: the load has gone the whole recoverable strain.
    stroke = system.wire.constitutive.recoverable_strain / load.contraction(system.wire)
    return TemperatureVsc(
        vsc=vsc3_of_section_4_6(system),
        band=Passing(passing_speed=1.7),
        temperature_band=30.8,
        temperature_gain=1.32,
        finish_filter=0.02,
        finish_temperature=law.austenite_finish,
        stress_slope=law.stress_slope_austenite,
        finish_position=load.start() + stroke,
    )


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


READING_STRAIN = 3.2e-5  # of the wire, which moves the arm by 0.1 deg: noise of a usual reading


def adaptive_filter(system: System) -> AdaptiveFilter:
    """`model_filter` that also estimates the convection and, of a load that has them, damping and inertia.

    What these have wrong needs no walks any more: they are 0.3 to 0.03 of `model_filter`'s. Nor has the amplitude of a branch to stand for it.
    """
    names, less = mismatches_of(system), 0.3
    filtered = dataclasses.replace(model_filter(system), keeps_branches=True)
    walks = {
        "position_walk": filtered.position_walk,
        "velocity_walk": less * filtered.velocity_walk,
        "temperature_walk": less * filtered.temperature_walk,
        "fraction_walk": 3e-4,
        "reading_noise": READING_STRAIN / moving_load(system).contraction(system.wire),
    }
    return AdaptiveFilter(
        filter=set_parameters(filtered, walks),
        ratio_error=0.12,
        ratio_time=100.0,
        estimated=tuple(names[one] for one in ("convection", "damping", "inertia") if one in names),
    )


def with_printed_law(system: System) -> System:
    """The plant that section 4.8 is written for: the integrated law without a thermal term (eq. 4.51)."""
    constitutive = dataclasses.replace(system.wire.constitutive, form=IntegratedForm())
    wire = dataclasses.replace(system.wire, constitutive=constitutive)
    return set_parameters(dataclasses.replace(system, wire=wire), {"thermal_modulus": 0.0})


def layered(controller: AbstractController, width: Scalar) -> AbstractController:
    """VSC1 with a layer of half thickness `width` (rad): the controller that it is in the limit of none, with a derivative."""
    assert isinstance(controller, Vsc1)
    return Vsc2(controller.high_voltage, controller.low_voltage, width)


PID_BOX: Box = {
    "proportional_gain": (0.5, 100.0),
    "integral_gain": (0.1, 100.0),
    "derivative_gain": (0.05, 30.0),
    "unwinding_time": (0.02, 20.0),
}
# The upper voltage is the printed one: more would be another amplifier.
SWITCH_BOX: Box = {"high_voltage": (5.0, 10.0), "low_voltage": (0.5, 5.0)}
SURFACE_BOX: Box = {"surface_slope": (0.5, 30.0), "boundary": (0.02, 30.0)}
# A_f' changes by 37 C/s at most in these steps: with a band beyond that the temperature is never given back.
PASSING_BOX: Box = {"temperature_band": (1.0, 37.0), "temperature_gain": (0.1, 30.0), "passing_speed": (0.05, 10.0)}
# A stress known to 1 MPa is what an estimator gives: 1e-6 V/Pa answers that with one volt.
STRESS_BOX: Box = {
    "surface_slope": (0.5, 20.0),
    "gain": (1e-3, 0.1),
    "boundary": (0.3, 30.0),
    "stress_gain": (2e-8, 1e-6),
    "stress_integral_gain": (1e-8, 5e-6),
    "stress_derivative_gain": (1e-10, 1e-7),
}


# Of backstepping on another load. x'' + K x' + K_0 x = 0 asks for a force of I K_0 x: on a light load, which its guide damps,
# next to nothing at the arm's K_0. The same share of the load's force for the same share of the stroke, and K/K_0 by the wire's
# time; how fast errors of stress and temperature die out is up to the control period, not to the plant.
_PER_FORCE = {"force": 1, "inertia": -1, "position": -1}
_DIE_OUT: dict[str, tuple[Mapping[str, int], ...]] = {"stress_gain": ({},), "temperature_gain": ({},)}
MOTION_ONE = {"position_gain": (_PER_FORCE,), "damping_gain": ({**_PER_FORCE, "time": 1},), **_DIE_OUT}
# Approach II takes its curve by the sign of dPhi/dv = c - I K, which is the load's damping c while I K is the smaller.
MOTION_TWO = {
    "position_gain": (_PER_FORCE, {"damping": 1, "inertia": -1, "time": -1}),
    "damping_gain": ({**_PER_FORCE, "time": 1}, {"damping": 1, "inertia": -1}),
    **_DIE_OUT,
}
# Name on the command line -> controller. One in a file of its own, with its preset, is one line:
# "my_pi": "smajax.control.controllers.my_pi:PRESET".
CONTROLLERS: dict[str, ControllerPreset] = resolved(
    {
        "pid": ControllerPreset(pid, "proportional_gain", ANGLE, PID_BOX),
        "vsc1": ControllerPreset(vsc1, "high_voltage", ANGLE, SWITCH_BOX, smoothed=layered),
        "vsc2": ControllerPreset(vsc2, "boundary", ANGLE, {**SWITCH_BOX, "boundary": (0.01, 1.0)}),
        "vsc3": ControllerPreset(vsc3, "surface_slope", ANGLE, {**SWITCH_BOX, **SURFACE_BOX}),
        "nvsc": ControllerPreset(
            temperature_vsc,
            "temperature_gain",
            STATE,
            {**SWITCH_BOX, **SURFACE_BOX, **PASSING_BOX},
            needs=STROKE,
            known=frozenset({"finish_temperature", "stress_slope", "finish_position"}),
        ),
        "sld": ControllerPreset(
            quick_stress_sliding,
            "surface_slope",
            STATE,
            STRESS_BOX,
            needs=EQUATION,
            known=frozenset({"equation", "cross_section"}),
        ),
        "backstepping1": ControllerPreset(
            backstepping_one,
            "damping_gain",
            STATE,
            {"damping_gain": (0.2, 10.0), "stress_gain": (1.0, 150.0)},
            with_printed_law,
            needs=EQUATION,
            scales=MOTION_ONE,
        ),
        "backstepping2": ControllerPreset(
            backstepping_two,
            "damping_gain",
            STATE,
            {"damping_gain": (0.2, 10.0), "temperature_gain": (1.0, 150.0)},
            with_printed_law,
            needs=EQUATION,
            scales=MOTION_TWO,
        ),
        "backstepping1_integral": "smajax.control.controllers.backstepping_integral:ONE",
        "backstepping2_integral": "smajax.control.controllers.backstepping_integral:TWO",
        "feedforward_pi": "smajax.control.controllers.feedforward_pi:PRESET",
        "receding_horizon": "smajax.control.controllers.receding_horizon:PRESET",
    }
)
OF_THE_SOURCE = ("pid", "vsc1", "vsc2", "vsc3", "nvsc", "sld", "backstepping1", "backstepping2")  # chapter 4's eight
# Name on the command line -> filter.
FILTERS: dict[str, Callable[[System], AbstractEstimator]] = {
    "printed": printed_filter,
    "model": model_filter,
    "adaptive": adaptive_filter,
}


def filter_of(name: str, system: System, noise: float | str = 0.0) -> AbstractEstimator:
    """The filter of this name in `FILTERS` that believes in `system`, for readings with this noise.

    noise: standard deviation of a reading, rad or m or text (`"0.3 deg"`), as the loop's sensor has it; of one that shows steps of q at least q over the root of 12. 0: not known, and the filter has its preset's (`model`:
    2e-5 of the wire's length, 0.06 deg of the arm; `adaptive`: 3.2e-5, 0.1 deg). `printed` keeps the R of its preset. Raises KeyError for a
    filter there is not, ValueError for a load that it does not go with.
    """
    if name not in FILTERS:
        raise KeyError(f"no filter {name!r}{close_matches(name, FILTERS, 'there are')}")
    made, unit = FILTERS[name](system), moving_load(system).reading[1]
    sigma = parse_quantity(noise, unit, bare=unit)
    return made.with_reading_noise(sigma) if sigma else made


def controllers_for(system: System) -> list[str]:
    """The controllers by name that this plant gives all that they need."""
    return [name for name, preset in CONTROLLERS.items() if not preset.missing(system)]


def check_name(name: object) -> None:
    """TypeError for a controller where the name of one is expected."""
    if not isinstance(name, str):
        raise TypeError(
            f"expected the name of a controller, got a {type(name).__name__}: one of your own gets a name, the box of its gains and how it is made by "
            "`sma.CONTROLLERS['name'] = ControllerPreset(...)` (docs/how-to/add-a-controller.md)."
        )


def check_controller(name: str, system: System) -> None:
    """ValueError for a controller there is not, or one that needs what this plant does not give; with those that can. TypeError for what is no name."""
    check_name(name)
    if name not in CONTROLLERS:
        raise ValueError(f"no controller `{name}`{close_matches(name, CONTROLLERS, 'there are')}.")
    if lacking := CONTROLLERS[name].missing(system):
        able = controllers_for(system)
        who = f"controllers that work on it: {listed(able)}" if able else "no controller works on it"
        raise ValueError(f"controller `{name}` cannot lead the load {type(system.load).__name__}: {lacking}; {who}.")


def code_of_parts(controller: str, estimator: str = "") -> str:
    """Digest of what a controller and a filter of these names do, also of ones that a script puts into `CONTROLLERS` and `FILTERS`."""
    parts = [CONTROLLERS[controller], *([FILTERS[estimator]] if estimator else [])]
    return code_mark(f"The controller {controller}" + (f" or the filter {estimator}" if estimator else ""), *parts)
