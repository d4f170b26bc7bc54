"""Effects of friction, slack, springs and loads against closed forms."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.model.effects.library import LIBRARY
from smajax.model.extended import extended
from smajax.model.load.friction import PRESLIDING
from smajax.model.presets import build
from smajax.model.system import initial_state
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.effect_rigs import DT, RIGS, settled


@pytest.mark.slow
def test_a_friction_that_grows_with_the_load_is_that_share_of_each_weight() -> None:
    """The same wire under two weights: a friction of one size, chosen for the one, is wrong for the other by their ratio."""
    system = RIGS["dead_weight"][0]
    voltage = jnp.asarray(np.concatenate([np.full(300, 7.4), np.zeros(300)]))

    def moved(effect: str, value: float, mass: float) -> np.ndarray:
        full = extended(system, (effect,), {effect + {"p": ".share", "c": ".limit"}[effect[0]]: value})
        return np.asarray(simulate_compiled(full, {"voltage": voltage, "mass": jnp.full(600, mass)}, DT).position)

    for mass in (0.07, 0.12):
        shared = moved("pulley_friction", 0.1, mass)
        np.testing.assert_allclose(shared, moved("coulomb_friction", 0.1 * mass * 9.81, mass), atol=1e-12)
        assert np.abs(shared - moved("coulomb_friction", 0.0, mass)).max() > 1e-5


def test_stribeck_friction_falls_from_its_value_at_rest_to_that_in_motion() -> None:
    """Whatever the wire pulls beyond weight, inertia and damping is the bristle of Canudas de Wit et al. (1995) along the path.

    Where the load has slipped on in one direction for a while, that is the curve over the speed, against the motion.
    """
    system, rest, sliding, speed, bend = RIGS["dead_weight"][0], 0.2, 0.4, 1.5e-3, 1e-5
    mass, damping = 0.075, 200.0
    slow = set_parameters(system, {"load_mass": mass, "damping": damping})
    voltage = {"voltage": jnp.asarray(np.concatenate([np.full(6000, 7.4), np.zeros(6000)]))}

    def run(effect: str, **values: float) -> Any:
        own = {f"{effect}.{name}": value for name, value in values.items()}
        return simulate_compiled(extended(slow, (effect,), own), voltage, DT / 20.0)

    found = run("stribeck_friction", limit=rest, sliding=sliding, speed=speed, bend=bend)
    area = 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    v = np.asarray(found.velocity)
    inertia = mass * np.gradient(v, DT / 20.0)
    rubs = area * np.asarray(found.stress) - mass * 9.81 - damping * v - inertia
    x, time = np.asarray(found.position), DT / 20.0 * np.arange(v.size)
    fine = np.linspace(time[0], time[-1], 20 * (time.size - 1) + 1)
    path, speeds = np.interp(fine, time, x), np.interp(fine, time, np.abs(v))
    curve = sliding + (1.0 - sliding) * np.exp(-((speeds / speed) ** 2))
    share = np.zeros(fine.size)
    for i, way in enumerate(np.diff(path) / bend, 1):  # delta df/dx = sign(x) - f/h(v), by Euler's implicit method
        share[i] = (share[i - 1] + way) / (1.0 + abs(way) / curve[i])
    share += 0.3 * np.sqrt(10.0 * bend / 9.81) * np.gradient(share, fine)  # its damping
    moves = np.abs(v) > 2e-4
    assert (moves & (v > 0.0)).sum() > 100
    assert (moves & (v < 0.0)).sum() > 100
    assert np.abs(v).max() > 2.0 * speed
    np.testing.assert_allclose(rubs[moves], rest * share[::20][moves], atol=0.02 * rest)
    # Once up and down: at either turn the bristle first bends to the other side.
    slips = moves & (np.where(v > 0.0, x - x[0], x.max() - x) > 10.0 * bend) & (np.abs(np.gradient(v, time)) < 2e-3)
    assert slips.sum() > 200
    np.testing.assert_allclose(np.abs(rubs)[slips], rest * curve[::20][slips], atol=0.05 * rest)
    alike = run("stribeck_friction", limit=rest, sliding=1.0, speed=speed, bend=PRESLIDING).position
    np.testing.assert_allclose(alike, run("coulomb_friction", limit=rest).position, rtol=0.0, atol=1e-12)


# At the long steps a few do not converge. What they leave in the position is what this is about.
@pytest.mark.filterwarnings("ignore:.*did not converge:smajax.simulation.simulate.UnsolvedWarning")
@pytest.mark.parametrize(("speed", "bend"), [(2e-4, 2e-5), (5e-4, 2e-5), (1e-3, 2e-5), (5e-4, 1e-4)])
def test_a_sliding_load_keeps_sliding_at_any_step(speed: float, bend: float) -> None:
    """Friction that falls with the speed: at a long step the same readings as at short ones, to a hundredth of the stroke."""
    own = {"stribeck_friction.limit": 0.2, "stribeck_friction.sliding": 0.3, "stribeck_friction.speed": speed}
    own["stribeck_friction.bend"] = bend
    system = extended(RIGS["dead_weight"][0], ("stribeck_friction",), own)
    voltage = np.concatenate([np.full(200, 7.4), np.zeros(200), np.full(200, 7.4)])
    long, shorter, short = (
        np.asarray(simulate_compiled(system, {"voltage": jnp.asarray(np.repeat(voltage, k))}, DT / k).position)[::k]
        for k in (1, 4, 16)
    )
    stroke = np.ptp(short)
    assert 0.01 < stroke < 0.025
    assert np.abs(long - short).max() < 0.02 * stroke
    assert np.sqrt(np.mean((long - short) ** 2)) < 3e-3 * stroke
    assert np.sqrt(np.mean((shorter - short) ** 2)) < 3e-3 * stroke


@pytest.mark.parametrize("bend", [1e-5, 5e-5])
def test_a_load_that_comes_to_rest_on_its_friction_stays_there(bend: float) -> None:
    """A weight with next to no viscous friction: it neither rings on its bristle nor creeps on, so that the error goes down with the tolerance.

    Without damping of the bristle 6 to 50 micrometres were left at these tolerances.
    """
    known = {"load_mass": 1.0, "damping": 0.2, "wire_length": 0.4, "wire_diameter": 2.5e-4}
    system = set_parameters(build("niti_table_3_1", "dead_weight", "voltage"), known)
    own = {"coulomb_friction.limit": 0.8, "coulomb_friction.bend": bend}
    rubbing = extended(system, ("coulomb_friction",), own)
    voltage = {"voltage": jnp.asarray(np.concatenate([np.full(80, 7.0), np.zeros(120), np.full(80, 5.6)]))}
    coarse, fine, exact = (
        np.asarray(simulate_compiled(rubbing, voltage, 0.1, tolerance).position) for tolerance in (1e-4, 1e-5, 1e-8)
    )
    assert 0.015 < np.ptp(exact) < 0.025
    assert np.sqrt(np.mean((coarse - exact) ** 2)) < 2e-6
    assert np.sqrt(np.mean((fine - exact) ** 2)) < 3e-7


def test_friction_has_numbers_in_single_precision_whatever_the_time() -> None:
    """A command that is late by a part of a sample divides a step into parts that are far shorter than the rounding of the time."""
    known = {"load_mass": 1.0, "damping": 1.0, "wire_length": 0.4, "wire_diameter": 2.5e-4}
    system = set_parameters(build("niti_table_3_1", "dead_weight", "voltage"), known)
    own = {"coulomb_friction.limit": 0.8, "input_delay.delay": 0.1}
    rubbing = extended(system, ("coulomb_friction", "input_delay"), own)
    voltage = {"voltage": jnp.asarray(np.concatenate([np.full(80, 7.0), np.zeros(120)]))}
    double = simulate_compiled(rubbing, voltage, 0.1).position
    with jax.enable_x64(False):
        narrow = jax.tree.map(lambda leaf: leaf.astype(jnp.float32) if eqx.is_array(leaf) else leaf, (rubbing, voltage))
        single = simulate_compiled(narrow[0], narrow[1], 0.1).position
    assert single.dtype == jnp.float32
    np.testing.assert_allclose(single, double, rtol=0.0, atol=5e-3 * np.ptp(double))


def test_a_loose_wire_leaves_the_arm_on_its_stop_until_it_has_taken_up_its_length() -> None:
    """The temperature at which it leaves is that of the strain s/l_0; from there on both run in parallel."""
    system, length = build("niti_table_3_1", "arm", "amplified_voltage"), 6e-3
    assert LIBRARY["loose_start"].candidate.applies(system)
    voltage = {"voltage": jnp.concatenate([jnp.full(600, 7.5), jnp.zeros(900)])}
    plain, loose = (
        simulate_compiled(one, voltage, 0.01)
        for one in (system, extended(system, ("loose_start",), {"loose_start.length": length}))
    )
    stop = float(system.load.lower_stop)
    on_stop = np.asarray(loose.position) <= stop + 1e-9
    leaves = int(np.argmin(on_stop))
    assert leaves > 10
    assert float(loose.stress[0]) == 0.0
    # The stop lets go when the wire pulls as hard as the load at rest does on a taut one.
    assert float(loose.stress[leaves - 1]) == pytest.approx(float(plain.stress[0]), rel=0.05)
    # What the wire is too long by, less the elastic strain at rest, is the strain that it takes up on the stop.
    span, modulus = float(system.wire.wire_length), float(system.wire.constitutive.young_modulus_martensite)
    assert float(loose.strain[0]) == pytest.approx(length / span - float(plain.stress[0]) / modulus, rel=1e-6)
    assert float(loose.strain[leaves - 1]) == pytest.approx(0.0, abs=2e-5)
    geometric = -float(system.load.contraction(system.wire)) * (np.asarray(loose.position) - stop)
    taut = np.asarray(loose.stress) > 0.0
    np.testing.assert_allclose(np.asarray(loose.strain)[taut], geometric[taut], atol=1e-9)
    assert on_stop[-1]
    assert 0.2 < np.asarray(loose.position).max() - stop < np.asarray(plain.position).max() - stop


def test_a_spring_in_series_takes_up_a_loose_wire_with_it() -> None:
    system, compliance = build("niti_table_3_1", "arm", "amplified_voltage"), 1e-3
    still = {"voltage": jnp.zeros(())}
    at_rest = float(initial_state(system, still).wire.stress)
    area = 0.25 * np.pi * float(system.wire.wire_diameter) ** 2
    modulus, span = float(system.wire.constitutive.young_modulus_martensite), float(system.wire.wire_length)
    on = {"series_compliance.compliance": compliance, "loose_start.length": 1e-3}
    begun = initial_state(extended(system, ("series_compliance", "loose_start"), on), still)
    assert float(begun.wire.stress) == pytest.approx(at_rest - 1e-3 / (span / modulus + compliance * area), rel=1e-6)


def test_a_loose_length_below_the_elastic_stretch_lowers_the_stress() -> None:
    system = build("niti_table_3_1", "arm", "amplified_voltage")
    modulus, span = float(system.wire.constitutive.young_modulus_martensite), float(system.wire.wire_length)
    at_rest = float(initial_state(system, {"voltage": jnp.zeros(())}).wire.stress)
    half = 0.5 * at_rest / modulus * span
    begun = initial_state(extended(system, ("loose_start",), {"loose_start.length": half}), {"voltage": jnp.zeros(())})
    assert float(begun.wire.stress) == pytest.approx(0.5 * at_rest, rel=1e-9)
    assert float(begun.wire.strain) == 0.0


def test_a_spring_in_series_stretches_by_force_over_stiffness() -> None:
    """Cold, 0.5 N are hung on: the load sags by F/k more than without it."""
    system, compliance = RIGS["dead_weight"][0], 2e-4
    mass = jnp.where(jnp.arange(400) < 10, 0.075, 0.075 + 0.5 / 9.81)
    inputs = {"voltage": jnp.zeros(400), "mass": mass}
    held = simulate_compiled(system, inputs, DT).position
    soft = simulate_compiled(
        extended(system, ("series_compliance",), {"series_compliance.compliance": compliance}), inputs, DT
    )
    assert soft.position[-1] - held[-1] == pytest.approx(-0.5 * compliance, rel=1e-6)
    taken = extended(system, ("slack",), {"slack.length": 1e-3, "slack.force": 0.4})
    before, after = 0.075 * 9.81, 0.075 * 9.81 + 0.5
    expected = 1e-3 * (np.exp(-after / 0.4) - np.exp(-before / 0.4))
    assert simulate_compiled(taken, inputs, DT).position[-1] - held[-1] == pytest.approx(expected, rel=1e-5)


def test_a_nonlinear_spring_pulls_with_the_force_of_its_formula() -> None:
    system, end = settled("nonlinear_spring", {"change": 2.0, "displacement": 5e-3}, "bias_spring", duty=0.35)
    x, k = end.position, float(system.load.spring_stiffness)
    force = float(system.load.spring_preload) + k * x + 2.0 * k * x**3 / (x**2 + 25e-6)
    assert x > 5e-3
    assert end.stress * 0.25 * np.pi * 0.5e-3**2 == pytest.approx(force, rel=1e-6)


def test_a_wrong_load_is_on_the_wire_from_the_start_and_a_shifted_one_from_its_time() -> None:
    weight, area = 0.075 * 9.81, 0.25 * np.pi * 150e-6**2
    system = RIGS["dead_weight"][0]
    inputs = {"voltage": jnp.zeros(401)}
    wrong = simulate_compiled(extended(system, ("wrong_load",), {"wrong_load.share": 0.2}), inputs, DT)
    np.testing.assert_allclose(wrong.stress, 1.2 * weight / area, rtol=1e-6)
    shift = {"load_shift.share": 0.2, "load_shift.time": 10.0, "load_shift.width": 0.1}
    shifted = simulate_compiled(extended(system, ("load_shift",), shift), inputs, DT)
    assert shifted.stress[100] == pytest.approx(weight / area, rel=1e-6)
    assert shifted.stress[-1] == pytest.approx(1.2 * weight / area, rel=1e-6)
