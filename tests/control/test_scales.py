"""Gains of the arm on another plant: by the units of each, the same number in scales of the stroke, force, voltage and time."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.controllers.preset import WIDER
from smajax.control.least_time import command_limit
from smajax.control.presets import CONTROLLERS, pid
from smajax.control.run_notes import voltages_of_limit
from smajax.control.scales import HEADROOM, arm_scales, exponents, factors_for, scales_of, unit_on
from smajax.core.parameters import get_parameters, parameter_values, parameters, set_parameters
from smajax.model.presets import build
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.report.loop_words import source_sentences
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.small_bench import smajax

HANGING = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SPRING = build("flexinol_ht_500um", "bias_spring", "voltage")


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("V/(rad s)", {"command": 1, "position": -1, "time": -1}),
        ("V s/rad", {"command": 1, "position": -1, "time": 1}),
        ("N m", {"force": 1}),
        ("V s/Pa", {"command": 1, "time": 1, "stress": -1}),
        ("1/s^2", {"time": -2}),
        ("degC/s", {"warmth": 1, "time": -1}),
        ("-", {}),
    ],
)
def test_a_unit_names_its_scales(unit: str, powers: dict[str, int]) -> None:
    assert exponents(unit) == powers


def test_a_unit_with_another_part_has_none() -> None:
    assert exponents("V per unit of s") is None
    assert exponents("kg") is None


def test_every_gain_that_is_tuned_has_a_unit_that_is_known() -> None:
    for preset in CONTROLLERS.values():
        table = parameters(preset.make(arm()))
        assert all(exponents(table[name].unit) is not None for name in preset.box)


def test_the_scales_of_the_arm_are_those_of_its_presets() -> None:
    """Its largest command is 10 V, `HEADROOM` over what holds it; of itself every factor is 1, and its gains stay."""
    assert float(arm_scales().command) * HEADROOM == pytest.approx(10.0, abs=0.02)
    system = arm()
    factors = factors_for(system, pid(system), {})
    assert [float(one) for one in factors.values()] == pytest.approx([1.0] * len(factors), rel=1e-12)
    for name, preset in CONTROLLERS.items():
        made, own = preset.make(system), preset.on_arm(system)
        names = list(parameters(own))
        np.testing.assert_array_equal(get_parameters(made, names), get_parameters(own, names), err_msg=name)
        assert preset.box_on(system) is preset.box


@pytest.mark.parametrize("system", [HANGING, SPRING], ids=["dead weight", "bias spring"])
def test_the_voltage_scale_holds_the_wire_at_the_end_of_its_transformation(system: System) -> None:
    """Held at it, the wire comes to A_f and its shift under the load, to the last hundredth of martensite."""
    scales = scales_of(system)
    seconds = float(scales.time)
    # Ten times in which it warms, and one in which it cools.
    volts = np.where(np.arange(1101) < 1000, float(scales.command), 0.0)
    whole = simulate_compiled(system, {"voltage": jnp.asarray(volts)}, seconds / 100.0)
    run = jax.tree.map(lambda series: series[:1001], whole)
    law, air = system.wire.kinetics, system.wire.heat.ambient_temperature
    assert float(run.temperature[-1]) - float(air) == pytest.approx(float(scales.warmth), rel=0.03)
    assert float(run.martensite_fraction[-1]) < 0.01
    assert float(run.position[-1]) == pytest.approx(float(scales.position), rel=0.12)
    hot = float(law.austenite_finish + scales.stress / law.stress_slope_austenite)
    assert float(scales.warmth) == pytest.approx(hot - float(air))
    warm = float(run.temperature[-1]) - float(air)
    assert float(whole.temperature[-1]) - float(air) == pytest.approx(warm / np.e, rel=0.01)


def test_the_time_scale_is_the_wire_s_own() -> None:
    """m c_p / (h A): 1.35 s of the arm's wire, 0.52 s and 8.4 s of the others (hand calculation)."""
    expected = (
        1.14e-4 * 837.0 / (150.0 * np.pi * 150e-6),
        6450.0 * 75e-6**2 * 322.0 / (150.0 * 150e-6),
        6450.0 * 250e-6**2 * 837.0 / (80.0 * 500e-6),
    )
    for system, seconds in zip((arm(), HANGING, SPRING), expected, strict=True):
        assert float(scales_of(system).time) == pytest.approx(seconds, rel=1e-9)


def test_pid_asks_the_same_share_of_the_voltage_for_the_same_share_of_the_stroke() -> None:
    theirs, ours = arm_scales(), scales_of(HANGING)
    there, here = pid(arm()), CONTROLLERS["pid"].make(HANGING)
    for name, per_time in (("proportional_gain", 0), ("integral_gain", 1), ("derivative_gain", -1)):
        both = []
        for controller, scales in ((there, theirs), (here, ours)):
            share = getattr(controller, name) * scales.position / scales.command
            both.append(float(share * scales.time**per_time))
        assert both[1] == pytest.approx(both[0], rel=1e-12)
    low, high = CONTROLLERS["pid"].box_on(HANGING)["proportional_gain"]
    assert high / low == pytest.approx(200.0 * WIDER**2, rel=0.01), "the box of the arm, and room on either side"
    assert low < float(here.proportional_gain) < high


def test_no_command_is_beyond_the_drive_s_limit() -> None:
    """A weak amplifier: all voltages are less in proportion, the largest is the limit itself."""
    weak = set_parameters(HANGING, {"amplifier_limit": 5.0})  # at the wire, through a gain of 1.6
    limit = 5.0 / 1.6
    for name in ("pid", "vsc3", "sld"):
        made = CONTROLLERS[name].make(weak)
        own = {one: float(get_parameters(made, [one])[0]) for one in parameters(made)}
        largest = max(value for one, value in own.items() if one in ("largest_voltage", "high_voltage"))
        assert largest <= 1.001 * limit
    switched = dataclasses.replace(HANGING, drive=build("flexinol_table_3_2", "dead_weight", "duty").drive)
    assert float(switched.drive.largest_command()) == 25.0


def test_units_of_gains_are_those_of_the_position() -> None:
    units = {"V/rad": "V/m", "V/(rad s)": "V/(m s)", "N m": "N", "rad/s": "m/s", "V/Pa": "V/Pa"}
    for there, here in units.items():
        assert unit_on(there, arm()) == there
        assert unit_on(there, HANGING) == here


def test_scales_are_functions_of_the_plant_s_parameters() -> None:
    """Under `jit` and with a derivative: twice the load's mass is twice its force."""

    def force(mass: jax.Array) -> jax.Array:
        return scales_of(set_parameters(HANGING, {"load_mass": mass})).force

    assert float(jax.jit(jax.grad(force))(jnp.asarray(0.075))) == pytest.approx(9.81, rel=1e-9)


@pytest.mark.parametrize("name", ["pid", "sld", "vsc3", "nvsc", "backstepping1", "receding_horizon"])
def test_an_arm_whose_amplifier_has_a_limit_is_led_up_to_that_limit(name: str) -> None:
    """At the wire 30.6 V, 17 V of the command through its gain of 1.8; the presets' 1000 V say that nobody knows it."""
    preset, system = CONTROLLERS[name], set_parameters(arm(), {"amplifier_limit": 30.6})
    made, own = parameter_values(preset.make(system)), parameter_values(preset.make(arm()))
    assert command_limit(system, preset.make(system)) == pytest.approx(17.0)
    switched = {"high_voltage": 1.7}  # at the low level the wire is to cool, whatever the amplifier
    for gain in set(parameters(preset.on_arm(system))) - {"amplifier_limit", "largest_voltage"}:
        assert made[gain] == pytest.approx(switched.get(gain, 1.0) * own[gain]), gain
    for gain, (low, high) in preset.box_on(system).items():
        assert (low, high) == pytest.approx(np.multiply(preset.box[gain], switched.get(gain, 1.0)), rel=1e-9)


@pytest.mark.parametrize("limit", [1000.0, 30.6, 12.0])
def test_a_limit_that_jax_traces_gives_the_same_controller(limit: float) -> None:
    """Also the one of 1000 V that says that nobody knows it: the presets' own voltages hold then."""
    preset = CONTROLLERS["vsc3"]

    def voltages(at: jax.Array) -> jax.Array:
        controller = preset.make(set_parameters(arm(), {"amplifier_limit": at}))
        table = parameters(controller)
        return get_parameters(controller, [name for name in table if table[name].unit == "V"])

    known = np.asarray(voltages(jnp.asarray(limit)))
    np.testing.assert_allclose(jax.jit(voltages)(jnp.asarray(limit)), known, rtol=1e-12)
    assert known.size > 0
    slopes = jax.jacrev(voltages)(jnp.asarray(limit))
    np.testing.assert_allclose(slopes, jax.jacfwd(voltages)(jnp.asarray(limit)))
    assert np.isfinite(slopes).all()


@pytest.mark.parametrize(
    ("limit", "said"),
    [
        (
            30.6,
            "is 17 V and was 10 V where the gains of the presets were searched: their voltages are 1.7 times as large; low levels",
        ),
        (
            9.0,
            "is 5 V and was 10 V where the gains of the presets were searched: their voltages are 0.5 times as large.",
        ),
        (18.0, ""),  # the presets' own
        (1000.0, ""),  # nobody knows it
    ],
)
def test_it_is_said_by_how_much_another_limit_changes_the_voltages_of_presets(limit: float, said: str) -> None:
    sentences = source_sentences(voltages_of_limit(set_parameters(arm(), {"amplifier_limit": limit})))
    assert len(sentences) == bool(said)
    assert all(said in one for one in sentences)
    assert voltages_of_limit(SPRING) == []  # of another load all gains are scaled, which is said by itself


def test_a_run_says_it(tmp_path: Path) -> None:
    words = ["simulate", "--controller", "pid", "--set", "amplifier_limit=12", "--set-point", "-40deg:1s", "--no-open"]
    assert "their voltages are 0.667 times as large" in smajax(*words, "--out", tmp_path / "run").out
