"""The loop around a controller: sample time, delay, sensor, disturbances, references and figures of merit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.control.closed_loop import check_answers, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.figures_of_merit import band_of, merit
from smajax.control.load_equation import moving_load
from smajax.control.measured_state import MeasuredState, Sensor
from smajax.control.presets import CONTROLLERS, pid, quick_stress_sliding
from smajax.control.reference import Reference, clock, constant, ramp, resting, sampled, sine, steps
from smajax.control.reference_file import read_reference
from smajax.core.parameters import get_parameters, set_parameters
from smajax.core.units import UnitError
from smajax.data.readers.table import MeasuredDataError
from smajax.engine import Engine, program
from smajax.model.drive.duty import Duty
from smajax.model.load.base import GRAVITY
from smajax.model.presets import amplified_voltage, arm, build, niti_table_3_1
from smajax.model.system import System
from smajax.model.types import Scalar
from smajax.simulation.compiled import simulate_compiled
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often

ARM = System(niti_table_3_1(), arm(), amplified_voltage())
DT = 0.01
RUN = by_machine_code(simulate_closed_loop)


class Played(AbstractController):
    """Says the set point itself, as volts: what it asked for and when can be read off the command."""

    def start(self, measured: MeasuredState, wanted: Reference) -> Scalar:
        return jnp.zeros(())

    def step(self, memory: Scalar, measured: MeasuredState, wanted: Reference, period: Scalar) -> tuple[Any, Scalar]:
        return memory, wanted.position


VOLTS = jnp.asarray(np.random.default_rng(1).uniform(0.0, 9.0, 201))


@pytest.mark.parametrize(("every", "delay"), [(1, 0), (4, 0), (1, 3), (4, 2)])
def test_a_command_is_held_for_a_period_and_delayed(every: int, delay: int) -> None:
    loop = RUN(ARM, Played(), VOLTS, DT, every, delay=delay)
    asked = np.asarray(VOLTS)[:-1:every]
    late = np.concatenate([np.zeros(delay), asked])[: len(asked)]
    held = np.append(np.repeat(late, every), late[-1])
    np.testing.assert_array_equal(loop.voltage, held)
    # And the plant is the simulator's own under that command.
    alone = simulate_compiled(ARM, {"voltage": jnp.asarray(held)}, DT)
    np.testing.assert_allclose(loop.run.position, alone.position, rtol=0.0, atol=1e-12)


def test_a_loop_of_a_duty_cycle_heats_as_one_of_the_voltage() -> None:
    """A supply behind an amplifier of gain 1 gives the same power by its duty, until there is no more of it."""
    supply = System(ARM.wire, ARM.load, Duty(supply_voltage=16.2))
    volts = jnp.linspace(0.0, 20.0, 201)
    by_duty = RUN(supply, Played(), volts, DT)
    direct = RUN(ARM, Played(), jnp.minimum(volts, 16.2) / 1.8, DT)
    np.testing.assert_allclose(by_duty.run.temperature, direct.run.temperature, rtol=0.0, atol=1e-9)


def test_a_sensor_quantises_and_adds_white_noise() -> None:
    target = constant(clock(3.0, DT), 0.2)
    counted = RUN(ARM, pid(ARM), target, DT, sensor=Sensor(quantum=0.01), key=jax.random.key(0))
    counts = np.asarray(counted.measured.position) / 0.01
    np.testing.assert_allclose(counts, np.round(counts), rtol=0.0, atol=1e-9)
    assert np.abs(counted.measured.position - counted.run.position).max() < 0.0051
    shaken = RUN(ARM, pid(ARM), target, DT, sensor=Sensor(noise_sigma=1e-3), key=jax.random.key(0))
    off = np.asarray(shaken.measured.position - shaken.run.position)[:-1]
    assert 0.9e-3 < off.std() < 1.1e-3
    assert abs(np.corrcoef(off[1:], off[:-1])[0, 1]) < 0.2
    with pytest.raises(ValueError, match="key"):
        simulate_closed_loop(ARM, pid(ARM), target, DT, sensor=Sensor())


def test_integral_action_rejects_disturbances() -> None:
    time = clock(12.0, DT)
    target = constant(time, 0.2)
    pushed = jnp.where(time < 6.0, 0.0, 4e-3)
    loop = RUN(ARM, pid(ARM), target, DT, disturbance={"load_torque": pushed})
    before, after = 595, -5
    assert abs(float(loop.run.position[before]) - 0.2) < 2e-3
    assert abs(float(loop.run.position[after]) - 0.2) < 1e-2
    # At rest the wire carries the torque: sigma = tau / (2 r A_w).
    lever = 2.0 * 8.25e-3 * 0.25 * np.pi * 150e-6**2
    gravity = (0.05719 + 0.5 * 0.0187) * GRAVITY * 0.04738
    statics = [
        (gravity * np.cos(x) + 3.871 * 0.048**2 * (x + np.pi / 4) + torque) / lever
        for x, torque in ((float(loop.run.position[before]), 0.0), (float(loop.run.position[after]), 4e-3))
    ]
    assert float(loop.run.stress[before]) == pytest.approx(statics[0], rel=0.02)
    assert float(loop.run.stress[after]) == pytest.approx(statics[1], rel=0.02)
    warmer = RUN(ARM, pid(ARM), target, DT, disturbance={"ambient_temperature": jnp.full_like(time, 40.0)})
    assert float(warmer.voltage[-1]) < float(loop.voltage[before]) - 0.5
    with pytest.raises(ValueError, match="wind"):
        simulate_closed_loop(ARM, pid(ARM), target, DT, disturbance={"wind": pushed})
    with pytest.raises(ValueError, match="samples"):
        simulate_closed_loop(ARM, pid(ARM), target, DT, disturbance={"load_torque": pushed[:-1]})


def test_a_payload_that_is_put_down_is_carried_and_is_inertia() -> None:
    """At rest the stress is that of the statics with the mass; beside it the moment of inertia is (m_p + dm + m_a/3) L^2."""
    time = clock(12.0, DT)
    target = constant(time, 0.2)
    loop = RUN(ARM, pid(ARM), target, DT, disturbance={"added_mass": jnp.where(time < 6.0, 0.0, 0.02)})
    lever = 2.0 * 8.25e-3 * 0.25 * np.pi * 150e-6**2
    for at, added in ((595, 0.0), (-5, 0.02)):
        x = float(loop.run.position[at])
        assert abs(x - 0.2) < 1e-2
        torque = (0.05719 + added + 0.5 * 0.0187) * GRAVITY * 0.04738 * np.cos(x) + 3.871 * 0.048**2 * (x + np.pi / 4)
        assert float(loop.run.stress[at]) == pytest.approx(torque / lever, rel=0.02)
    assert np.abs(np.asarray(loop.run.position)[600:] - 0.2).max() > 0.02
    load = moving_load(ARM)
    heavier = load.inertia({"added_mass": jnp.asarray(0.02)})
    assert float(heavier) == pytest.approx((0.05719 + 0.02 + 0.0187 / 3.0) * 0.04738**2, rel=1e-6)
    assert float(load.inertia({})) == pytest.approx((0.05719 + 0.0187 / 3.0) * 0.04738**2, rel=1e-6)


def test_sliding_control_follows_a_ramp_and_a_sine() -> None:
    time = clock(10.0, DT)
    late = np.asarray(time) > 3.0
    for wanted in (ramp(time, -0.6, 0.6, 6.0), sine(time, 0.0, 0.25, 0.1)):
        loop = RUN(ARM, quick_stress_sliding(ARM), wanted, DT)
        error = np.asarray(loop.run.position - wanted.position)[late]
        assert np.sqrt(np.mean(error**2)) < np.radians(1.5)


def test_references_have_the_derivatives_of_their_positions() -> None:
    time = clock(4.0, 1e-3)
    for wanted in (ramp(time, -0.5, 0.5, 5.0), sine(time, 0.1, 0.3, 0.7), sampled(jnp.sin(time), 1e-3)):
        inside = slice(3, -3)
        slope = np.gradient(np.asarray(wanted.position), 1e-3)
        np.testing.assert_allclose(wanted.velocity[inside], slope[inside], atol=1e-5)
        np.testing.assert_allclose(wanted.acceleration[inside], np.gradient(slope, 1e-3)[inside], atol=1e-3)
    stairs = steps(clock(1.0, 0.1), [1.0, 2.0, 3.0], 0.3)
    np.testing.assert_array_equal(stairs.position, [1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3])
    np.testing.assert_array_equal(resting(VOLTS).velocity, np.zeros(201))


def test_a_reference_is_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "path.csv"
    path.write_text("time,angle\n0,0\n1,90\n3,-90\n", encoding="utf-8")
    lines = read_reference(path, "time", "angle", "deg", 0.5)
    np.testing.assert_allclose(np.degrees(lines.position), [0, 45, 90, 45, 0, -45, -90], atol=1e-9)
    assert float(lines.velocity[4]) == pytest.approx(-np.pi / 2)
    held = read_reference(path, "time", "angle", "deg", 0.5, held=True)
    np.testing.assert_allclose(np.degrees(held.position), [0, 0, 90, 90, 90, 90, -90], atol=1e-9)
    with pytest.raises(MeasuredDataError, match="angel"):
        read_reference(path, "time", "angel", "deg", 0.5)
    with pytest.raises(UnitError):
        read_reference(path, "time", "angle", "volt", 0.5)


def test_figures_of_merit_of_a_known_run_are_right() -> None:
    """A hand-made trajectory: rises to 1.1, back to 1 within the band from 3 s on; the command turns back once."""
    loop = RUN(ARM, Played(), jnp.ones(501), DT)
    time = loop.run.time
    position = jnp.interp(time, jnp.asarray([0.0, 1.0, 2.0, 3.0, 5.0]), jnp.asarray([0.0, 1.0, 1.1, 1.01, 1.01]))
    voltage = jnp.where((time > 1.0) & (time < 2.0), 10.0, 2.0)
    made = eqx.tree_at(lambda one: (one.run.position, one.voltage), loop, (position, voltage))
    one = merit(made, ARM, band=0.02)
    assert float(one.reach_time) == pytest.approx(0.98, abs=1.5 * DT)
    # It shows its numbers, in a batch too, and stays a pytree.
    assert "overshoot=0.1" in str(one)
    assert "f64[" not in str(jax.tree.map(lambda value: jnp.stack([value, value]), one))
    assert "dtype=float64" in str(jax.eval_shape(lambda value: value, one))
    assert float(one.settling_time) == pytest.approx(2.0 + 0.08 / 0.09, abs=1.5 * DT)
    assert float(one.overshoot) == pytest.approx(0.1, abs=1e-9)
    assert float(one.steady_error) == pytest.approx(0.01, abs=1e-9)
    assert float(one.switches_per_second) == pytest.approx(1 / 5.0)
    # R_w = 45 ohm/m times 0.9 m; the amplifier's gain is 1.8.
    volts = 1.8 * np.asarray(voltage)[:-1]
    assert float(one.energy) == pytest.approx(float((volts**2).sum() * DT / (45.0 * 0.9)), rel=1e-6)
    never = eqx.tree_at(lambda one: one.run.position, loop, jnp.zeros_like(position))
    assert np.isinf(float(merit(never, ARM).settling_time))


def test_figures_of_merit_of_cycles_chatter_and_runs_that_never_arrive_are_right() -> None:
    loop = RUN(ARM, Played(), jnp.ones(501), DT)
    time = loop.run.time

    def judged(position: Any, voltage: Any = 0.0, band: float = 0.02) -> Any:
        parts = jnp.broadcast_to(position, time.shape), jnp.broadcast_to(voltage, time.shape)
        return merit(eqx.tree_at(lambda one: (one.run.position, one.voltage), loop, parts), ARM, band=band)

    # A cycle about the set point that is inside the band at the last sample only.
    cycle = judged(1.0 + 0.3 * jnp.sin(2.0 * jnp.pi * time))
    assert abs(float(jnp.sin(2.0 * jnp.pi * time[-1]))) < 0.01
    assert np.isinf(float(cycle.settling_time))
    # Ten turns up and ten down a second between 6 and 8.5 V, after one long spell at 10 V and one dip to 0 V.
    chatter = jnp.where(jnp.floor(time * 20.0 + 1e-6) % 2 == 0, 6.0, 8.5)
    lively = judged(1.0, jnp.where(time < 1.0, 10.0, jnp.where(time < 1.1, 0.0, chatter)))
    assert float(lively.switches_per_second) == pytest.approx(20.0 * 3.9 / 5.0, rel=0.05)
    # At its set point from the start: whatever leads away from it is overshoot.
    assert float(judged(1.0 - 0.2 * jnp.exp(-((time - 2.0) ** 2))).overshoot) == pytest.approx(0.2, rel=1e-6)
    # From above: beyond is below.
    fall = judged(1.0 + jnp.where(time < 1.0, 0.5, -0.1))
    assert float(fall.overshoot) == pytest.approx(0.1)
    assert float(fall.reach_time) == pytest.approx(1.0, abs=1.5 * DT)


def test_the_settling_band_of_a_length_is_a_share_of_its_stroke() -> None:
    hanging = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
    assert float(band_of(hanging)) == pytest.approx(0.01 * 0.02475)
    assert float(band_of(ARM)) == pytest.approx(np.radians(1.0))


@pytest.mark.parametrize(
    ("name", "engine"),
    often(
        [("sld", "xla"), ("sld", "native"), ("backstepping1", "native"), ("backstepping2", "native")],
        [("sld", "native"), ("backstepping2", "native")],
    ),
)
def test_a_wrong_gain_of_a_batch_makes_only_its_own_run_nan(name: str, engine: Engine) -> None:
    """In a batch, where no error can be raised: a gain that is no number, and one out of its bounds."""
    controller = CONTROLLERS[name].make(ARM)
    gain = CONTROLLERS[name].main_gain
    good = float(get_parameters(controller, [gain])[0])
    values = np.asarray([good, np.nan, -good, good])

    def run(_: None, own: dict[str, Any]) -> Any:
        return simulate_closed_loop(ARM, set_parameters(controller, own), jnp.full(31, 0.3), DT)

    loop = program(run, None, (gain,), engine=engine)(None, {gain: values})
    np.testing.assert_array_equal(np.isfinite(loop.failed_at), [False, True, True, False])
    np.testing.assert_array_equal(loop.voltage[1:3], 0.0)
    np.testing.assert_array_equal(loop.run.position[0], loop.run.position[3])
    assert float(jnp.abs(loop.voltage[0]).max()) > 1.0
    with pytest.raises(ValueError, match=f"{gain}.*-"):
        run(None, {gain: -good})


def test_a_closed_loop_refuses_wrong_lengths_delays_and_nan() -> None:
    with pytest.raises(ValueError, match="multiple of 4"):
        simulate_closed_loop(ARM, Played(), jnp.ones(100), DT, 4)
    with pytest.raises(ValueError, match="delay"):
        simulate_closed_loop(ARM, Played(), jnp.ones(101), DT, delay=-1)
    gone = jnp.where(jnp.arange(101) < 50, 1.0, jnp.nan)
    with pytest.raises(ValueError, match="the set point `wanted` is nan at sample 51"):
        simulate_closed_loop(ARM, Played(), gone, DT)
    with pytest.raises(ValueError, match="the disturbance `load_torque` is nan at sample 51"):
        simulate_closed_loop(ARM, Played(), jnp.ones(101), DT, disturbance={"load_torque": gone})
    with pytest.raises(ValueError, match=r"`wanted` has the shape \(\); expected a series"):
        simulate_closed_loop(ARM, Played(), jnp.asarray(0.5), DT)
    for dt in (-0.01, 0.0, float("nan")):
        with pytest.raises(ValueError, match="`dt` is the time between two samples"):
            simulate_closed_loop(ARM, Played(), jnp.ones(101), dt)
    for sigma in (-1.0, float("nan")):
        with pytest.raises(ValueError, match="outside of the bounds: `noise_sigma`"):
            simulate_closed_loop(ARM, Played(), jnp.ones(101), DT, sensor=Sensor(sigma), key=jax.random.key(0))
    with pytest.raises(ValueError, match="a clock takes seconds of 0 or more and a `dt` above zero"):
        clock(1.0, -0.01)
    # Under `jit` a set point is not known: what its controller answers is told.
    broken = RUN(ARM, Played(), gone, DT)
    assert float(broken.failed_at) == pytest.approx(0.5)
    assert np.isfinite(broken.run.position).all()
    np.testing.assert_array_equal(broken.voltage[50:], 0.0)
    with pytest.raises(ValueError, match=r"0\.500 s"):
        check_answers(broken)
