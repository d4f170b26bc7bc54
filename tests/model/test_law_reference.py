"""The four laws against an independent, event-aware scipy integration: coupons, rigs, and a controlled run."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import simulate_closed_loop
from smajax.control.presets import stress_sliding
from smajax.core.parameters import set_parameters
from smajax.model.presets import build
from smajax.model.system import System, initial_state
from smajax.model.wire.branch_amplitude import AsPrinted
from smajax.model.wire.form import IntegratedForm
from smajax.model.wire.laws import LAWS, under_law
from smajax.model.wire.stiffness import Constant
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import DEFAULT_STEP
from studies.reference.path_reference import simulate_path
from studies.reference.sliding import sliding_controller
from studies.reference.wire_parameters import ArmParameters, DeadWeightParameters
from studies.reference.wire_reference import simulate_arm, simulate_dead_weight
from tests.helpers.often import often

RUN = simulate_compiled
NAMES = sorted(name for name, law in LAWS.items() if law.form is None)  # `integrated`: a variety of `enhanced`
DETWINNING: dict[str, Any] = {"detwinning_start": 10e6, "detwinning_finish": 40e6}
LEG = 400  # samples between two corners


def _under(system: System, law: str, **parts: object) -> System:
    wire = under_law(system.wire, law)
    kinetics = {name: part for name, part in parts.items() if name == "renewal"}
    constitutive = {name: part for name, part in parts.items() if name != "renewal"}
    wire = dataclasses.replace(
        wire,
        kinetics=dataclasses.replace(wire.kinetics, **kinetics),
        constitutive=dataclasses.replace(wire.constitutive, **constitutive),
    )
    return dataclasses.replace(system, wire=wire)


# Temperature (C) and stress (Pa) at the corners: heating and unloading together, partial loops, loading of austenite.
CORNERS = [
    (23.0, 60e6),
    (90.0, 140e6),
    (84.0, 80e6),
    (60.0, 100e6),
    (95.0, 90e6),
    (75.0, 330e6),
    (75.0, 40e6),
    (110.0, 120e6),
    (30.0, 70e6),
]
VARIETIES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "printed renewal": {"renewal": "printed"},
    "integrated": {"constitutive": "integrated"},
    "constant E": {"stiffness": "martensite"},
}
OURS: dict[str, dict[str, Any]] = {
    "as it is": {},
    "printed renewal": {"renewal": AsPrinted()},
    "integrated": {"form": IntegratedForm()},
    "constant E": {"stiffness": Constant()},
}


@pytest.mark.parametrize(
    ("variety", "law"),
    often(
        itertools.product(sorted(VARIETIES), NAMES),
        [
            *(("as it is", law) for law in NAMES),
            ("printed renewal", "tanaka"),
            ("integrated", "enhanced"),
            ("constant E", "brinson"),
        ],
    ),
)
def test_coupon_follows_the_reference(law: str, variety: str) -> None:
    corners = np.array(CORNERS)
    at = np.arange(len(CORNERS))
    parameters = DeadWeightParameters(law=law, **VARIETIES[variety], **DETWINNING)
    reference = simulate_path(parameters, CORNERS, at.astype(float))
    fine = np.arange(LEG * (len(CORNERS) - 1) + 1) / LEG
    temperature, stress = (jnp.asarray(np.interp(fine, at, corners[:, k])) for k in (0, 1))
    system = _under(build("flexinol_table_3_2", "coupon", "none"), law, **OURS[variety])
    run = RUN(system, {"temperature": temperature, "stress": stress}, 1.0)
    # A closed form at constant stress; where stress and temperature move together the samples are steps.
    np.testing.assert_allclose(run.martensite_fraction[::LEG], reference["martensite_fraction"], atol=2e-3)
    np.testing.assert_allclose(run.detwinned_fraction[::LEG], reference["detwinned_fraction"], atol=4e-3)
    strain = np.asarray(run.strain[::LEG])
    np.testing.assert_allclose(strain - strain[0], reference["strain"] - reference["strain"][0], atol=2e-4)


@pytest.mark.parametrize("law", NAMES)
def test_strain_coupon_follows_the_reference(law: str) -> None:
    corners = [(75.0, 0.0), (75.0, 0.03), (75.0, 0.012), (95.0, 0.02), (95.0, 0.001), (40.0, 0.01)]
    at = np.arange(len(corners))
    parameters = DeadWeightParameters(law=law, initial_martensite_fraction=0.0, initial_temperature=75.0, **DETWINNING)
    reference = simulate_path(parameters, corners, at.astype(float), control="strain")
    fine = np.arange(LEG * (len(corners) - 1) + 1) / LEG
    temperature, strain = (jnp.asarray(np.interp(fine, at, np.array(corners)[:, k])) for k in (0, 1))
    system = set_parameters(_under(build("flexinol_table_3_2", "strain_coupon", "none"), law), {"start_fraction": 0.0})
    run = RUN(system, {"temperature": temperature, "strain": strain}, 1.0)
    np.testing.assert_allclose(run.martensite_fraction[::LEG], reference["martensite_fraction"], atol=4e-3)
    np.testing.assert_allclose(run.stress[::LEG], reference["stress"], atol=3e6)


@functools.cache
def _arm() -> System:
    return build("niti_table_3_1", "arm", "amplified_voltage")


def _arm_parameters(law: str) -> ArmParameters:
    arm = _arm()
    start = initial_state(arm, {"voltage": jnp.asarray(0.0)})
    return ArmParameters(
        law=law,
        surface_per_metre=float(np.pi * 150e-6),
        initial_stress=float(start.wire.stress),
        recoverable_strain=float(arm.wire.constitutive.recoverable_strain),
        spring_radius=float(arm.load.spring_lever),
        **DETWINNING,
    )


EVERY = 10  # samples of the default step between compared ones


@pytest.mark.parametrize("law", often(["tanaka", "brinson"], ["tanaka"]))
def test_arm_step_follows_the_reference(law: str) -> None:
    """7.2 V for 12 s at the default step (the enhanced law's is in test_reference)."""
    samples = round(12.0 / DEFAULT_STEP)
    times = np.arange(0, samples + 1, EVERY) * DEFAULT_STEP
    reference = simulate_arm(_arm_parameters(law), [(12.0, 7.2)], times)
    run = RUN(_under(_arm(), law), {"voltage": jnp.full(samples + 1, 7.2)}, DEFAULT_STEP)
    assert np.degrees(np.abs(run.position[::EVERY] - reference["angle"])).max() < 0.05
    assert np.abs(run.martensite_fraction[::EVERY] - reference["martensite_fraction"]).max() < 1e-3


def test_dead_weight_of_voltage_steps_follows_the_reference() -> None:
    """M11 at 75 g: heated through the range and cooled, enhanced law, default step."""
    samples = round(8.0 / DEFAULT_STEP)
    times = np.arange(0, samples + 1, EVERY) * DEFAULT_STEP
    reference = simulate_dead_weight(DeadWeightParameters(), [(4.0, 7.4, 0.075), (8.0, 0.0, 0.075)], times)
    volts = jnp.where(jnp.arange(samples + 1) * DEFAULT_STEP < 4.0 - 1e-9, 7.4, 0.0)
    run = RUN(build("flexinol_table_3_2", "dead_weight", "voltage"), {"voltage": volts}, DEFAULT_STEP)
    assert np.abs(run.martensite_fraction[::EVERY] - reference["martensite_fraction"]).max() < 1e-3
    assert np.abs(run.position[::EVERY] - reference["position"]).max() < 5e-5


@pytest.mark.slow  # the loops of chapter 4 are in `test_figures`
def test_controlled_arm_follows_the_reference_for_twenty_seconds() -> None:
    """Regulation at 85 degrees, enhanced law, default step, control period 10 ms."""
    law, seconds, period = "enhanced", 20.0, 0.01
    ours = stress_sliding(_arm())
    times = np.arange(0.0, seconds + 1e-9, 0.05)
    reference = simulate_arm(
        _arm_parameters(law),
        [],
        times,
        controller=sliding_controller(ours, np.radians(85.0), period),
        period=period,
        memory=0.0,
    )
    samples = round(seconds / DEFAULT_STEP)
    target = jnp.full(samples + 1, jnp.radians(85.0))
    loop = eqx.filter_jit(simulate_closed_loop)(_arm(), ours, target, DEFAULT_STEP, round(period / DEFAULT_STEP))
    at = slice(None, None, round(0.05 / DEFAULT_STEP))
    assert np.degrees(np.abs(loop.run.position[at] - reference["angle"])).max() < 0.05
    assert np.abs(loop.run.martensite_fraction[at] - reference["martensite_fraction"]).max() < 1e-3
