"""The simulator against an independent, event-aware scipy integration of the same equations."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.model.presets import build
from smajax.model.system import System, initial_state
from smajax.model.wire.conditions import Liang
from smajax.simulation.compiled import simulate_compiled
from studies.reference.wire_reference import (
    ArmParameters,
    DeadWeightParameters,
    simulate_arm,
    simulate_dead_weight,
)

RUN = simulate_compiled
EVERY = 0.05  # s between compared samples


def _arm() -> System:
    return build("niti_table_3_1", "arm", "amplified_voltage")


def _reference_arm(volts: float, seconds: float) -> dict[str, np.ndarray]:
    start = initial_state(_arm(), {"voltage": jnp.asarray(0.0)})
    arm = _arm()
    parameters = ArmParameters(
        surface_per_metre=float(np.pi * 150e-6),
        initial_stress=float(start.wire.stress),
        recoverable_strain=float(arm.wire.constitutive.recoverable_strain),
        spring_radius=float(arm.load.spring_lever),
    )
    return simulate_arm(parameters, [(seconds, volts)], np.arange(0.0, seconds + 1e-9, EVERY))


@pytest.fixture(scope="module")
def arm_73() -> dict[str, np.ndarray]:
    return _reference_arm(7.3, 30.0)


def _ours(volts: float, seconds: float, dt: float):
    every = round(EVERY / dt)
    run = RUN(_arm(), {"voltage": jnp.full(round(seconds / dt) + 1, volts)}, dt)
    return run, slice(None, None, every)


def test_partial_transformation_at_7_2_volt_agrees_with_the_reference() -> None:
    """M2: nothing transforms below A_s', the steady temperature lies inside the range, the fraction stays between."""
    reference = _reference_arm(7.2, 30.0)
    run, at = _ours(7.2, 30.0, 0.005)
    assert np.degrees(np.abs(run.position[at] - reference["angle"])).max() < 0.05
    assert np.abs(run.martensite_fraction[at] - reference["martensite_fraction"]).max() < 1e-3
    start, finish = 68.0 + run.stress / 10.3e6, 78.0 + run.stress / 10.3e6
    assert np.all(run.martensite_fraction[run.temperature < start] == 1.0)
    assert start[-1] < run.temperature[-1] < finish[-1]
    assert 0.2 < run.martensite_fraction[-1] < 0.9


def test_full_transformation_at_7_3_volt_agrees_with_the_reference(arm_73: dict[str, np.ndarray]) -> None:
    """M3: past the angle of greatest stress the range falls through the temperature; the arm ends near 90 degrees."""
    run, at = _ours(7.3, 30.0, 0.005)
    assert np.degrees(np.abs(run.position[at] - arm_73["angle"])).max() < 0.05
    assert np.abs(run.martensite_fraction[at] - arm_73["martensite_fraction"]).max() < 1e-3
    assert run.martensite_fraction[-1] == 0.0
    assert np.degrees(run.position[-1]) == pytest.approx(90.6, abs=0.1)
    top = int(np.argmax(run.stress))
    assert 0 < top < len(run.stress) - 1
    assert run.stress[-1] < 0.7 * run.stress[top]
    assert run.temperature[-1] > 78.0 + run.stress[-1] / 10.3e6


def test_stress_and_fraction_stay_consistent_at_the_end_of_the_range() -> None:
    """With the printed eps_L, a 50 mm link and a 45 mm lever 7.3 V ends near 80.5 degrees.

    A fraction clipped after the stress has used its unclipped rate leaves a strain error for good: 112 degrees.
    """
    printed = {"recoverable_strain": 0.04, "arm_length": 0.05, "spring_lever": 0.045}
    run = RUN(set_parameters(_arm(), printed), {"voltage": jnp.full(3001, 7.3)}, 0.01)
    assert run.martensite_fraction[-1] == 0.0
    assert np.degrees(run.position[-1]) == pytest.approx(80.5, abs=1.0)


def test_higher_voltage_ends_higher() -> None:
    """M4."""
    ends = [float(np.degrees(_ours(volts, 30.0, 0.01)[0].position[-1])) for volts in (7.0, 7.2, 7.3)]
    assert ends[0] + 5.0 < ends[1] < ends[2] - 5.0


def test_integrator_is_of_second_order(arm_73: dict[str, np.ndarray]) -> None:
    errors = []
    for dt in (0.025, 0.0125):
        run, at = _ours(7.3, 30.0, dt)
        errors.append(float(np.abs(run.temperature[at] - arm_73["temperature"]).max()))
    assert 1.8 < np.log2(errors[0] / errors[1]) < 2.3


SWAP = [(20.0, 7.95, 0.363), (35.0, 7.95, 0.267), (50.0, 7.95, 0.363)]


def _swapped_mass(system: System, dt: float):
    time = np.arange(round(50.0 / dt) + 1) * dt
    mass = np.where((time > 20.0 - 1e-9) & (time < 35.0 - 1e-9), 0.267, 0.363)
    return RUN(system, {"voltage": jnp.full(len(time), 7.95), "mass": jnp.asarray(mass)}, dt)


def test_removing_and_replacing_the_mass_agrees_with_the_reference() -> None:
    """M13: removing mass transforms further and putting it back leaves the wire shorter, as the reference has it."""
    times = np.arange(0.0, 50.0 + 1e-9, EVERY)
    reference = simulate_dead_weight(DeadWeightParameters(), SWAP, times)
    run = _swapped_mass(build("flexinol_table_3_2", "dead_weight", "voltage"), 0.005)
    assert np.abs(run.position[::10] - reference["position"]).max() < 5e-6
    assert np.abs(run.martensite_fraction[::10] - reference["martensite_fraction"]).max() < 1e-4
    before, after = float(run.position[3999]), float(run.position[-1])
    assert after - before > 1e-4  # net shortening, m


def test_liang_conditions_leave_no_net_shortening_when_the_temperature_does_not_rise() -> None:
    """M13, the other half: with conditions on the temperature alone an unloading at constant temperature does nothing."""
    system = build("flexinol_table_3_2", "dead_weight", "voltage")
    # One resistivity: else the power, and with it the temperature, follows the fraction.
    system = set_parameters(system, {"resistivity_austenite": 76e-8})
    liang = eqx.tree_at(lambda s: s.wire.kinetics.conditions, system, Liang())
    shortening = {}
    for name, model in (("enhanced", system), ("liang", liang)):
        run = _swapped_mass(model, 0.01)
        shortening[name] = float(run.position[-1] - run.position[1990])
    assert shortening["enhanced"] > 1e-4
    assert abs(shortening["liang"]) < 0.05 * shortening["enhanced"]
