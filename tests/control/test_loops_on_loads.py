"""Controllers by name on a dead weight, a bias spring and a load of a user's own, in the load's unit; errors where one cannot."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax as sma
from smajax.control.controllers.pid import Pid
from smajax.control.controllers.preset import EQUATION
from smajax.control.estimators.model_filter import ModelFilter
from smajax.control.figures_of_merit import band_of
from smajax.control.gains_file import GainsFileError
from smajax.control.loop_around import loop_around
from smajax.control.loop_dataset import simulate_loop_dataset
from smajax.control.measured_state import Sensor
from smajax.control.position_unit import default_set_points, unit_of
from smajax.control.presets import CONTROLLERS, controllers_for, with_printed_law
from smajax.control.run_request import LoopRequest, RunRequest, run_closed
from smajax.model.load.coupon import Coupon
from smajax.model.rigs import arm
from smajax.model.system import System
from smajax.model.wire.heat import mass_per_metre
from smajax.report.loop_words import noise_words
from smajax.report.note_words import note_sentences
from smajax.report.simulate_words import run_sentences
from tests.helpers.often import often
from tests.helpers.own_load import Lever, Scheduled

HANGING = sma.compose("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
SPRING = sma.compose("flexinol_ht_500um", "bias_spring", "voltage")
OWN = dataclasses.replace(HANGING, load=Lever())
LOADS = {"dead weight": HANGING, "bias spring": SPRING, "own": OWN}
BY_READING = ("pid", "vsc1", "vsc2", "vsc3")
BY_EQUATION = (
    *("sld", "backstepping1", "backstepping2", "backstepping1_integral", "backstepping2_integral"),
    *("feedforward_pi", "receding_horizon"),
)
DT = 0.01


def led(system: System, controller: str, millimetres: float, seconds: float, **more: Any) -> np.ndarray:
    """Positions over time, mm, of a loop with the scaled gains."""
    loop = loop_around(system, controller, **more)
    run = simulate_loop_dataset(loop, f"{millimetres:g} mm", seconds, dt=DT, period=DT, tolerance=None)
    return 1e3 * run["position"].to_numpy()


@pytest.mark.parametrize(
    ("load", "controller"),
    often(
        itertools.product(LOADS, BY_READING),
        [("dead weight", "pid"), ("dead weight", "vsc3"), ("bias spring", "vsc1"), ("bias spring", "vsc2")],
    ),
)
def test_controllers_that_need_the_reading_alone_hold_a_set_point(load: str, controller: str) -> None:
    """With gains that nobody searched: half of the stroke, within a hundredth of it over the last fifth of the run."""
    system, seconds = LOADS[load], {"dead weight": 10.0, "bias spring": 60.0, "own": 15.0}[load]
    band = 1e3 * float(band_of(system))
    position = led(system, controller, 50.0 * band, seconds)
    assert np.abs(position[-len(position) // 5 :] - 50.0 * band).max() < band


@pytest.mark.parametrize("millimetres", [pytest.param(3.0, marks=pytest.mark.slow), 10.0])
def test_pid_ends_on_its_set_point(millimetres: float) -> None:
    """Its integral leaves no error: a micrometre, on both loads."""
    assert led(HANGING, "pid", millimetres, 20.0)[-1] == pytest.approx(millimetres, abs=1e-3)
    assert led(SPRING, "pid", millimetres, 160.0)[-1] == pytest.approx(millimetres, abs=1e-3)


@pytest.mark.parametrize(
    ("controller", "load"),
    often(
        itertools.product(["sld", "backstepping1", "backstepping2"], LOADS),
        [("sld", "own"), ("backstepping1", "bias spring"), ("backstepping2", "dead weight")],
    ),
)
def test_controllers_of_the_equation_of_motion_hold_a_set_point(controller: str, load: str) -> None:
    """On the law of eq. 4.51, which backstepping reads backwards."""
    system, seconds = LOADS[load], {"dead weight": 15.0, "bias spring": 160.0, "own": 20.0}[load]
    position = led(with_printed_law(system), controller, 6.0, seconds)
    assert np.abs(position[-len(position) // 5 :] - 6.0).max() < 1e3 * float(band_of(system))


@pytest.mark.parametrize("controller", often(["backstepping1", "backstepping2"], ["backstepping2"]))
def test_backstepping_follows_a_wire_of_another_law_from_its_measured_state(controller: str) -> None:
    """The rate form with a thermal term, on the spring; without the offset of the strain it does not come near."""
    made = CONTROLLERS[controller].make(SPRING)
    assert made.anchored
    assert led(SPRING, controller, 6.0, 160.0)[-1] == pytest.approx(6.0, abs=0.15)
    if controller == "backstepping2":
        loose = dataclasses.replace(made, anchored=False)
        run = simulate_loop_dataset(sma.Loop(SPRING, loose), "6 mm", 160.0, dt=DT, period=DT, tolerance=None)
        assert abs(1e3 * float(run["position"][-1]) - 6.0) > 3.0


@pytest.mark.slow
def test_the_temperature_controller_overshoots_by_less_than_the_vsc_that_is_in_it() -> None:
    """NVSC against the VSC3 that is in it, on the dead weight: less beyond the set point."""
    nvsc = CONTROLLERS["nvsc"].make(HANGING)
    assert float(nvsc.finish_position) == pytest.approx(0.02475)
    beyond = []
    for one in (nvsc, nvsc.vsc):
        run = simulate_loop_dataset(sma.Loop(HANGING, one), "12 mm", 5.0, dt=0.01, tolerance=None)
        beyond.append(1e3 * float(run["position"].max()) - 12.0)
    assert beyond[0] < 0.9 * beyond[1]


@pytest.mark.parametrize(
    "law", [*(pytest.param(law, marks=pytest.mark.slow) for law in ("tanaka", "liang", "brinson")), "enhanced"]
)
def test_any_wire_law_and_effects_are_a_plant(law: str) -> None:
    plant = sma.compose(
        "flexinol_table_3_2",
        "dead_weight",
        "flexinol_voltage",
        law=law,
        values={"latent_heat.enthalpy": "15 J/g", "series_compliance.compliance": 2e-5, "coulomb_friction.limit": 0.02}
        if law == "enhanced"
        else {"latent_heat.enthalpy": "15 J/g"},
    )
    assert led(plant, "pid", 8.0, 15.0)[-1] == pytest.approx(8.0, abs=0.05)


@pytest.mark.slow  # on the arm in `test_closed_loop`
def test_a_duty_cycle_heats_as_the_voltage_does() -> None:
    switched = dataclasses.replace(SPRING, drive=sma.DRIVES["duty"]())
    np.testing.assert_allclose(led(switched, "pid", 6.0, 20.0), led(SPRING, "pid", 6.0, 20.0), atol=1e-6)


@pytest.mark.parametrize(
    ("drive", "unit", "controller"),
    [
        ("current", "A", "vsc3"),
        ("power", "W", "sld"),
        *(
            pytest.param(drive, unit, controller, marks=pytest.mark.slow)
            for drive, unit, rest in (("current", "A", ("pid", "sld")), ("power", "W", ("pid", "vsc3")))
            for controller in (*rest, "backstepping2")
        ),
    ],
)
def test_a_current_source_and_a_power_supply_are_commanded_in_their_own_unit(
    drive: str, unit: str, controller: str
) -> None:
    fed = with_printed_law(dataclasses.replace(HANGING, drive=sma.DRIVES[drive]()))
    loop = loop_around(fed, controller)
    run = simulate_loop_dataset(loop, "8 mm", 10.0, dt=DT, tolerance=None)
    assert run[drive].attrs["units"] == unit
    assert np.abs(run["position"][-200:] - 8e-3).max() < float(band_of(fed))
    # What the command means: its heat is the loss to the air and what the wire's heat capacity takes.
    command, ohms = run[drive].to_numpy(), run["resistance"].to_numpy()
    power = command if drive == "power" else command**2 * ohms
    wire, temperature = fed.wire, run["temperature"].to_numpy()
    surface = np.pi * float(wire.wire_diameter) * float(wire.wire_length)
    loss = float(wire.heat.convection_coefficient) * surface * (temperature - float(wire.heat.ambient_temperature))
    stored = float(mass_per_metre(wire) * wire.wire_length * wire.heat.specific_heat) * (
        temperature[-1] - temperature[0]
    )
    assert DT * power[:-1].sum() == pytest.approx(DT * loss[1:].sum() + stored, rel=5e-3)


@pytest.mark.slow  # on the arm in `test_estimators`
def test_a_filter_and_noise_go_with_any_load() -> None:
    loop = loop_around(HANGING, "sld", estimator="model", noise="20 um")
    assert isinstance(loop.estimator, ModelFilter)
    assert loop.sensor is not None
    assert float(loop.sensor.noise_sigma) == pytest.approx(20e-6)
    run = simulate_loop_dataset(loop, "8 mm", 8.0, dt=0.01, tolerance=None, seed=3)
    assert float(run["position"][-100:].mean()) == pytest.approx(8e-3, abs=1e-4)
    other = simulate_loop_dataset(loop, "8 mm", 8.0, dt=0.01, tolerance=None, seed=4)
    assert not np.array_equal(run["voltage"], other["voltage"])


def test_gains_are_given_in_the_load_s_unit() -> None:
    loop = loop_around(HANGING, "pid", {"proportional_gain": "0.9 V/mm", "integral_gain": 1500.0})
    assert isinstance(loop.controller, Pid)
    assert float(loop.controller.proportional_gain) == pytest.approx(900.0)
    assert float(loop.controller.integral_gain) == 1500.0
    scaled = CONTROLLERS["pid"].make(HANGING)
    assert float(loop.controller.derivative_gain) == float(scaled.derivative_gain)
    with pytest.raises(sma.units.UnitError, match="V/m"):
        loop_around(HANGING, "pid", {"proportional_gain": "0.9 V/rad"})
    with pytest.raises(ValueError, match="no gain 'proportional'; did you mean 'proportional_gain'"):
        loop_around(HANGING, "pid", {"proportional": 1.0})
    with pytest.raises(ValueError, match="of one's own has its gains"):
        loop_around(HANGING, scaled, {"proportional_gain": 1.0})


def test_gains_of_the_arm_are_refused_on_a_length(tmp_path: Any) -> None:
    file = tmp_path / "gains.json"
    file.write_text('{"controller": "pid", "gains": {"proportional_gain": {"value": 12.8, "unit": "V/rad"}}}')
    with pytest.raises(GainsFileError, match="is given in 'V/rad'; expected 'V/m'"):
        loop_around(HANGING, "pid", file)


def test_what_a_controller_needs_and_a_plant_does_not_give_is_said() -> None:
    """Which controller, which load, what is missing, which controllers can."""
    scheduled = dataclasses.replace(HANGING, load=Scheduled())
    able = [name for name, one in CONTROLLERS.items() if one.needs != EQUATION]
    assert controllers_for(scheduled) == able
    assert {*BY_READING, "nvsc"} <= set(able)
    assert not set(BY_EQUATION) & set(able)
    assert controllers_for(HANGING) == list(CONTROLLERS)
    for name in ("sld", "backstepping1", "backstepping2"):
        with pytest.raises(
            ValueError, match=f"controller `{name}` cannot lead the load Scheduled: .*needs the input mass"
        ):
            loop_around(scheduled, name)
    with pytest.raises(ValueError, match=rf"controllers that work on it: {', '.join(able)}\."):
        loop_around(scheduled, "sld")
    with pytest.raises(ValueError, match="use the drive voltage, duty, current or power; no controller works on it"):
        loop_around(dataclasses.replace(HANGING, drive=sma.DRIVES["none"]()), "pid")
    with pytest.raises(ValueError, match="a Coupon moves nothing"):
        loop_around(dataclasses.replace(HANGING, load=Coupon()), "pid")
    with pytest.raises(ValueError, match="take the filter `model`"):
        loop_around(HANGING, "pid", estimator="printed")
    with pytest.raises(KeyError, match="did you mean 'pid'"):
        loop_around(HANGING, "pdi")


def test_a_load_that_asks_for_an_input_is_led_with_it() -> None:
    """Its mass goes from 60 g to 80 g; PID holds the set point. Without it, what to give."""
    loop = loop_around(dataclasses.replace(HANGING, load=Scheduled(ratio=1.0)), "pid")
    mass = np.where(np.arange(1501) < 750, 0.06, 0.08)
    run = simulate_loop_dataset(loop, "8 mm", 15.0, dt=0.01, tolerance=None, disturbance={"mass": mass})
    assert float(run["position"][-1]) == pytest.approx(8e-3, abs=1e-5)
    assert float(run["stress"][-1] / run["stress"][700]) == pytest.approx(8.0 / 6.0, rel=1e-3)
    with pytest.raises(ValueError, match=r"needs the input mass: give `disturbance=\{'mass': values\}`"):
        simulate_loop_dataset(loop, "8 mm", 15.0)


def test_compose_puts_a_controller_by_name_around_any_load() -> None:
    one = sma.compose("flexinol_ht_500um", "bias_spring", "voltage", controller="pid")
    run = sma.simulate_loop_dataset(one, "5mm:20s,2mm:20s", dt=0.02, period=0.02)
    assert run["wanted"].attrs["units"] == "m"
    np.testing.assert_allclose([run["wanted"][0], run["wanted"][-1]], [5e-3, 2e-3])


def test_a_registered_load_of_a_user_is_led_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """As an entry point `smajax.loads` puts it into the table."""
    monkeypatch.setitem(sma.LOADS, "lever", Lever)
    one = sma.compose(
        "flexinol_table_3_2", "lever", "flexinol_voltage", values={"stiffness": "12 N/m"}, controller="pid"
    )
    run = simulate_loop_dataset(one, "15 mm", 10.0, dt=DT, tolerance=None)
    assert float(run["position"][-1]) == pytest.approx(15e-3, abs=1e-5)


def test_a_controller_may_assume_another_plant_than_runs() -> None:
    heavier = sma.set_parameters(HANGING, {"load_mass": 0.1})
    loop = loop_around(heavier, "sld", estimator="model", assumed=HANGING)
    assert float(loop.system.load.load_mass) == 0.1
    assert float(loop.controller.equation.load.load_mass) == 0.075
    assert isinstance(loop.estimator, ModelFilter)
    assert float(loop.estimator.system.load.load_mass) == 0.075
    knowing = loop_around(heavier, "pid").controller
    assert float(knowing.proportional_gain) != float(CONTROLLERS["pid"].make(HANGING).proportional_gain)


def test_a_loop_is_closed_over_a_counter_of_its_own_steps() -> None:
    sensor = loop_around(HANGING, "pid", quantum="20 um").sensor
    assert sensor is not None
    assert float(sensor.quantum) == pytest.approx(2e-5)
    assert float(sensor.noise_sigma) == 0.0


def test_a_request_by_names_is_in_the_load_s_unit() -> None:
    request = RunRequest("flexinol_table_3_2", "dead_weight", "flexinol_voltage", dt=0.01, tolerance=None)
    result = run_closed(request, LoopRequest("pid", "6:5s", noise="10um", mismatch={"payload": "+20%"}))
    assert 1e3 * float(result.data["position"][-1]) == pytest.approx(6.0, abs=0.05)
    assert "the position with 0.01 mm of noise" in result.data.attrs["between"]
    assert [one.name for one in result.mismatches] == ["load_mass"]
    counted = run_closed(request, LoopRequest("pid", "6:5s", quantum="0.5mm"))
    assert "the position without noise in steps of 0.5 mm" in counted.data.attrs["between"]
    assert counted.loop is not None
    assert counted.loop.quantum == pytest.approx(5e-4)
    assert noise_words(counted.loop) == "no noise, in steps of 0.5 mm"
    beyond = run_closed(request, LoopRequest("pid", "40mm:2s"))
    assert any("the stroke of the wire under this load" in note for note in note_sentences(beyond.notes))


def test_set_points_by_default_lie_in_the_stroke() -> None:
    assert unit_of(HANGING).shown == "mm"
    points = default_set_points(HANGING)
    assert len(points) == 6
    assert points == tuple(sorted(points))
    assert 0.0 < points[0] < points[-1] < 24.75


def test_the_offset_of_the_strain_is_none_on_the_law_that_is_read_backwards() -> None:
    """At rest in the air eq. 4.53 is exact; of a wire with a thermal term it is off as soon as it is warm."""
    from smajax.control.controllers.inverse_wire import strain_offset
    from smajax.control.measured_state import truth
    from smajax.model.system import initial_state

    rest = truth(initial_state(with_printed_law(SPRING), {"voltage": jnp.zeros(())}))
    assert abs(float(strain_offset(with_printed_law(SPRING), rest))) < 1e-15
    run = sma.simulate(SPRING, {"voltage": jnp.full(201, 5.0)}, 0.05)
    last = dataclasses.replace(
        rest,
        position=run.position[-1],
        stress=run.stress[-1],
        martensite_fraction=run.martensite_fraction[-1],
    )
    # theta_T (T - T_0)/E of elastic strain, while all is martensite.
    expected = -0.55e6 * (float(run.temperature[-1]) - 22.0) / 28e9
    assert float(run.martensite_fraction[-1]) == 1.0
    assert float(strain_offset(SPRING, last)) == pytest.approx(expected, rel=1e-6)


def test_the_reading_of_a_loop_is_what_its_sensor_says_with_noise_and_steps() -> None:
    """It was the true position to the last digit, whatever the noise."""
    request = RunRequest(seconds=5.0)
    data = run_closed(request, LoopRequest("pid", "40deg", noise=0.5, quantum=0.2)).data
    every = round(0.01 / request.dt)
    said, true = (np.degrees(data[name].to_numpy()) for name in ("reading", "position"))
    np.testing.assert_allclose(said, 0.2 * np.round(said / 0.2), atol=1e-9)
    at_calls = (said - true)[:-1:every]
    assert np.std(at_calls) == pytest.approx(np.hypot(0.5, 0.2 / np.sqrt(12.0)), rel=0.1)
    held = said[:-1].reshape(-1, every)
    np.testing.assert_array_equal(held, held[:, :1] + np.zeros(every))
    # The controller was given nothing else.
    loop = sma.loop_around(arm(), "pid")
    stored = sma.simulate_closed_loop(
        arm(), loop.controller, jnp.full(201, 0.5), 0.005, 2, sensor=Sensor(jnp.asarray(0.01)), key=jax.random.key(0)
    )
    np.testing.assert_array_equal(stored.reading, stored.measured.position)
    assert float(jnp.abs(stored.reading - stored.run.reading).max()) > 0.01
    # Without noise it is the state's, at every sample.
    plain = run_closed(request, LoopRequest("pid", "40deg")).data
    np.testing.assert_array_equal(plain["reading"], plain["position"])


def test_a_noisy_reading_is_no_way_of_the_load() -> None:
    result = run_closed(RunRequest(seconds=2.0), LoopRequest("pid", "40deg", noise=5.0))
    moved = next(one for one in run_sentences(result) if one.startswith("The angle"))
    assert "starts at -45 deg, lies between -45 deg" in moved
