"""What is timed: the rotary arm lifted from rest by a constant voltage, its members and their exact solution.

The box lies within 5.5 to 8.5 V and 0.8 to 1.2 of the preset's payload: a payload heavier than 0.95 of it swings into
the upper stop at the highest voltage, and a stop is an event that other integrators would need a restart for.
"""

from __future__ import annotations

import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from smajax.cli import benchmark_arm as equations
from smajax.core.parameters import parameter_values
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import Axes, sampled
from studies.benchmarks.given import Given, load, save
from studies.reference.wire_parameters import ArmParameters
from studies.reference.wire_reference import simulate_arm

SECONDS = 10.0
EVERY = 0.05  # s between compared samples
ANGLE_LIMIT = 0.05  # degrees
FRACTION_LIMIT = 1e-3
VOLTAGES = (5.5, 8.5)  # V
PAYLOADS = (0.8, 0.95)  # of the preset's
SEED = 0
RTOL = 1e-10
CLOSE = 10  # samples of the exact solution for each compared one: the peaks between count for the checks


def sample_times() -> np.ndarray:
    """When solutions are compared, s."""
    return np.arange(round(SECONDS / EVERY) + 1) * EVERY


def constants() -> dict[str, float]:
    """Every parameter of the arm by smajax's name, SI, temperatures in C."""
    return parameter_values(arm())


def axes(count: int) -> Axes:
    """The members for the batch engine: `voltage` (V) and `payload_mass` (kg)."""
    payload = constants()["payload_mass"]
    masses = (PAYLOADS[0] * payload, PAYLOADS[1] * payload)
    return sampled(count, voltage=VOLTAGES, payload_mass=masses, seed=SEED)


def members(count: int) -> dict[str, np.ndarray]:
    """The same in numpy, each of shape (count,); fewer are the first of more."""
    return axes(count).runs(0, count)


def _reference(p: dict[str, float], payload_mass: float) -> ArmParameters:
    """One member in the reference's words."""
    cross = equations.area(p)
    start = equations.start(np, p, payload_mass)
    return ArmParameters(
        diameter=p["wire_diameter"],
        mass_per_metre=p["density"] * cross,
        surface_per_metre=float(np.pi * p["wire_diameter"]),
        specific_heat=p["specific_heat"],
        resistance_martensite=p["resistivity_martensite"] / cross,
        resistance_austenite=p["resistivity_austenite"] / cross,
        convection_coefficient=p["convection_coefficient"],
        ambient_temperature=p["ambient_temperature"],
        modulus_austenite=p["young_modulus_austenite"],
        modulus_martensite=p["young_modulus_martensite"],
        thermoelastic_coefficient=p["thermal_modulus"],
        recoverable_strain=p["recoverable_strain"],
        austenite_start=p["austenite_start"],
        austenite_finish=p["austenite_finish"],
        martensite_start=p["martensite_start"],
        martensite_finish=p["martensite_finish"],
        austenite_slope=p["stress_slope_austenite"],
        martensite_slope=p["stress_slope_martensite"],
        length=p["wire_length"],
        gain=p["amplifier_gain"],
        initial_stress=float(start[1] * p["stress_slope_austenite"]),
        pulley_radius=p["pulley_radius"],
        payload_mass=payload_mass,
        arm_mass=p["link_mass"],
        arm_length=p["arm_length"],
        spring_stiffness=p["spring_stiffness"],
        spring_radius=p["spring_lever"],
        spring_rest_angle=p["spring_rest_angle"],
        damping=p["damping"],
        lowest_angle=p["lower_stop"],
        highest_angle=p["upper_stop"],
        initial_angle=p["start_angle"],
    )


def _solved(p: dict[str, float], voltage: float, payload_mass: float) -> tuple[np.ndarray, np.ndarray]:
    """(angle in degrees, fraction) of one member; ValueError where it does what `smajax.cli.benchmark_arm` leaves out."""
    times = np.arange(CLOSE * round(SECONDS / EVERY) + 1) * (EVERY / CLOSE)
    run = simulate_arm(_reference(p, payload_mass), [(SECONDS, voltage)], times, rtol=RTOL)
    angle, xi, stress = run["angle"], run["martensite_fraction"], run["stress"]
    cooled = run["temperature"] - stress / p["stress_slope_martensite"] < p["martensite_start"]
    reasons = {
        "comes to an end stop": angle.max() >= p["upper_stop"] or (angle[1:] <= p["lower_stop"]).any(),
        "reaches the cooling curve": (cooled & (xi < 1.0)).any(),
        "goes slack with martensite in it": ((stress <= 0.0) & (xi > 0.0)).any(),
    }
    met = [reason for reason, true in reasons.items() if true]
    if met:
        raise ValueError(
            f"the arm at {voltage:g} V with {payload_mass:g} kg {' and '.join(met)}: make the box smaller."
        )
    return np.degrees(angle[::CLOSE]), xi[::CLOSE]


def given(solved: int, count: int, folder: Path) -> tuple[Path, Given]:
    """`count` members, the first `solved` of them integrated by scipy from event to event; and the file that stores them.

    About a third of a second a member that is solved, unless the file is there already.
    """
    p, box = constants(), members(count)
    request = {"constants": p, "rtol": RTOL, "limits": [ANGLE_LIMIT, FRACTION_LIMIT]}
    said = json.dumps(request, sort_keys=True)
    file = folder / f"arm_{solved}_of_{count}.npz"
    if file.is_file():
        cached = load(file)
        same = all(np.array_equal(getattr(cached, name), values) for name, values in box.items())
        if cached.said == said and same and np.array_equal(cached.times, sample_times()):
            return file, cached
    runs = [_solved(p, float(box["voltage"][k]), float(box["payload_mass"][k])) for k in range(solved)]
    angle, fraction = (np.array(each) for each in zip(*runs, strict=True))
    made = Given(said, box["voltage"], box["payload_mass"], sample_times(), angle, fraction)
    save(file, made)
    return file, made


def held(voltage: float, dt: float) -> jnp.ndarray:
    """One member's voltage over the run, one value a step of `dt` s."""
    return jnp.full(round(SECONDS / dt) + 1, voltage)
