"""PID and variable structure controllers: against plants with a known answer, at their edges, in their derivatives."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from jax import lax
from scipy import signal

from smajax.control.closed_loop import ClosedLoop, simulate_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.controllers.boundary_layer import AsPrinted, Continuous
from smajax.control.controllers.pid import Pid
from smajax.control.controllers.temperature_vsc import AsPrinted as AsPrintedBand
from smajax.control.controllers.temperature_vsc import TemperatureVsc
from smajax.control.measured_state import MeasuredState
from smajax.control.presets import (
    PID_TUNED_AT,
    pid,
    pid_tuned_at,
    temperature_vsc,
    vsc1,
    vsc2,
    vsc3,
    vsc3_of_section_4_6,
)
from smajax.control.reference import Reference, clock, constant
from smajax.core.parameters import get_parameters, parameters, set_parameters
from smajax.engine import program
from smajax.model.presets import amplified_voltage, arm, niti_table_3_1
from smajax.model.system import System
from tests.helpers.machine_code import by_machine_code
from tests.helpers.often import often

SYSTEM = System(niti_table_3_1(), arm(), amplified_voltage())
CONTROLLERS: dict[str, AbstractController] = {
    "pid": pid(SYSTEM),
    "vsc1": vsc1(SYSTEM),
    "vsc2": vsc2(SYSTEM),
    "vsc3": vsc3(SYSTEM),
    "nvsc": temperature_vsc(SYSTEM),
}
DT = 0.01
GAINS = Path(__file__).parents[2] / "studies" / "gains"


def told(position: Any) -> MeasuredState:
    """A state of which only the position is known: whoever reads more answers with nan."""
    return MeasuredState(jnp.asarray(position), *[jnp.asarray(jnp.nan)] * 6)


def set_point(position: Any) -> Reference:
    zero = jnp.zeros(())
    return Reference(jnp.asarray(position, dtype=float), zero, zero)


@by_machine_code
def driven(controller: Pid, a: Any, b: Any, c: Any, wanted: jax.Array, period: float) -> tuple[Any, Any, Any]:
    """(output, command, integral) of the discrete plant x' = a x + b u, y = c x under the controller."""
    start = jnp.zeros(a.shape[0]), controller.start(told(0.0), set_point(0.0))

    def body(carry: Any, target: Any) -> Any:
        x, memory = carry
        y = c @ x
        memory, u = controller.step(memory, told(y), set_point(target), jnp.asarray(period))
        return (a @ x + b * u, memory), (y, u, memory.integral)

    return lax.scan(body, start, wanted)[1]


def held(plant: tuple[Any, Any], period: float) -> tuple[Any, ...]:
    """The plant sampled with its input held (scipy): (a, b, c) and the polynomials of z."""
    a, b, c, _, _ = signal.cont2discrete(signal.tf2ss(*plant), period)
    return a, b[:, 0], c[0]


PLANT = ([2.0], [1.0, 0.8, 1.0])  # a damped swing
KP, KI, KD, TAU = 1.5, 0.9, 0.6, 0.08
LINEAR = Pid(KP, KI, KD, largest_voltage=1e4, smallest_voltage=-1e4, rate_filter=TAU)


def test_pid_on_a_linear_plant_is_the_discrete_transfer_function() -> None:
    """The closed loop in z, by polynomials, to rounding."""
    period, count = 0.05, 400
    a, b, c = held(PLANT, period)
    num, den = signal.ss2tf(a, b[:, None], c[None, :], np.zeros((1, 1)))
    num = num[0]
    # u = (K_p + K_i T/(z - 1)) (r - y) - K_d (z - 1)/((tau + T) z - tau) y
    one, lag = np.array([1.0, -1.0]), np.array([TAU + period, -TAU])
    on_error = np.polyadd(KP * one, [KI * period])  # over `one`
    forward = np.polymul(num, np.polymul(on_error, lag))
    back = np.polymul(num, np.polymul(KD * one, one))
    whole = np.polyadd(np.polymul(den, np.polymul(one, lag)), np.polyadd(forward, back))
    _, (expected,) = signal.dstep((forward, whole, period), n=count)
    y, _, _ = driven(LINEAR, a, b, c, jnp.ones(count), period)
    np.testing.assert_allclose(y, expected[:, 0], atol=1e-10)
    assert abs(y[-1] - 1.0) < 1e-3, "the integral leaves no steady error"


def test_pid_tends_to_the_continuous_controller_in_first_order() -> None:
    num, den = (np.array(part) for part in PLANT)
    lag = np.array([TAU, 1.0])
    forward = np.polymul(num, np.polymul([KP, KI], lag))
    back = np.polymul(num, [KD, 0.0, 0.0])
    whole = np.polyadd(np.polymul(den, np.polymul([1.0, 0.0], lag)), np.polyadd(forward, back))
    errors = []
    for period in (0.02, 0.01, 0.005):
        count = round(10.0 / period)
        time = period * np.arange(count)
        _, expected = signal.step((forward, whole), T=time)
        y, _, _ = driven(LINEAR, *held(PLANT, period), jnp.ones(count), period)
        errors.append(np.abs(y - expected).max())
    assert 0.9 < np.log2(errors[0] / errors[1]) < 1.1
    assert 0.9 < np.log2(errors[1] / errors[2]) < 1.1


def test_anti_windup_bounds_the_integral_and_returns_soon() -> None:
    """A first-order plant asked for more than its input can give, for 20 s; then for less."""
    period, unwinding = 0.05, 0.5
    plant = held(([1.0], [1.0, 1.0]), period)
    wanted = jnp.where(jnp.arange(800) < 400, 5.0, 0.5)
    one = Pid(2.0, 2.0, 0.0, largest_voltage=1.0, rate_filter=0.0, unwinding_time=unwinding)
    y, _, integral = driven(one, *plant, wanted, period)
    # At rest in saturation: 0 = T K_i e + (1 - u) T/(T_t + T), u = K_p e + I, e = 5 - 1.
    resting = 1.0 + (unwinding + period) * 2.0 * 4.0 - 2.0 * 4.0
    np.testing.assert_allclose(integral[399], resting, rtol=1e-6)
    assert np.abs(integral).max() < 10.0
    wound_y, wound_u, wound = driven(set_parameters(one, {"unwinding_time": 1e9}), *plant, wanted, period)
    assert wound[399] > 150.0, "without it the integral sums up all of the error"
    there = np.abs(np.asarray(y)[400:] - 0.5) < 0.05
    still_there = np.abs(np.asarray(wound_y)[400:] - 0.5) < 0.05
    soon = period * (np.flatnonzero(~there).max() + 1)
    assert soon < 4.0, f"recovered after {soon} s"
    # The plant stays where full input has brought it, to the end of the run.
    assert not still_there.any()
    assert np.asarray(wound_u)[-1] == 1.0


finite = some.floats(0.1, 100.0)


@settings(deadline=None)  # the first call compiles
@given(finite, finite, finite)
def test_the_boundary_layer_falls_linearly_from_high_to_low(high: float, low: float, boundary: float) -> None:
    high, low = max(high, low), min(high, low)
    edge = jnp.asarray(boundary)
    ends = jnp.asarray(high), jnp.asarray(low)
    at = [float(Continuous().voltage(jnp.asarray(k * boundary), edge, *ends)) for k in (-9, -1, -0.5, 0, 0.5, 1, 9)]
    np.testing.assert_allclose(
        at, [high, high, 0.75 * high + 0.25 * low, 0.5 * (high + low), 0.25 * high + 0.75 * low, low, low], rtol=1e-12
    )
    for side in (-1.0, 1.0):
        inside, outside = (
            float(Continuous().voltage(jnp.asarray(side * k * boundary), edge, *ends)) for k in (1 - 1e-9, 1 + 1e-9)
        )
        assert abs(inside - outside) < 1e-6 * high


@pytest.mark.parametrize("gain", [-100.0, -40.0, 40.0, 100.0])
def test_the_printed_layer_jumps_at_an_edge_whatever_its_gain(gain: float) -> None:
    layer, boundary = AsPrinted(gain), jnp.asarray(0.1)

    def at(surface: float) -> float:
        return float(layer.voltage(jnp.asarray(surface), boundary, jnp.asarray(10.0), jnp.asarray(4.0)))

    jumps = [abs(at(side * 0.0999999) - at(side * 0.1000001)) for side in (-1.0, 1.0)]
    assert max(jumps) > 3.9
    beyond, short = at(0.05), at(-0.05)
    assert (beyond > short) == (gain > 0.0), "K > 0 heats beyond the set point and not short of it"


def _loop(model: tuple[AbstractController, jax.Array], own: dict[str, jax.Array]) -> ClosedLoop:
    """A closed loop of 1.5 s on the arm, with the gains in `own`."""
    controller, degrees = model
    return simulate_closed_loop(
        SYSTEM, set_parameters(controller, own), constant(clock(1.5, DT), jnp.radians(degrees)), DT
    )


def _slope(model: tuple[AbstractController, jax.Array], own: dict[str, jax.Array]) -> jax.Array:
    """Derivative of the mean square error at the gains in `own`, along the direction there."""
    names = [name.removeprefix("along ") for name in own if name.startswith("along ")]
    at, along = ({name: own[f"{kind}{name}"] for name in names} for kind in ("", "along "))
    return jax.jvp(lambda gains: squares(_loop(model, gains)), (at,), (along,))[1]


def batch(controller: AbstractController, names: tuple[str, ...], gains: Any, degrees: Any) -> ClosedLoop:
    """Closed loops by machine code, one for each row of gains; compiled once a controller."""
    # `degrees` is an array: a plain number would compile again.
    own = dict(zip(names, np.asarray(gains).T, strict=True))
    return program(_loop, (controller, degrees), names, engine="native")((controller, degrees), own, 1)


def slopes(controller: AbstractController, names: tuple[str, ...], at: Any, degrees: Any) -> np.ndarray:
    """Derivatives of the mean square error by each gain."""
    own = {name: np.full(len(names), float(at[k])) for k, name in enumerate(names)}
    own |= {f"along {name}": row for name, row in zip(names, np.eye(len(names)), strict=True)}
    return program(_slope, (controller, degrees), tuple(own), engine="native")((controller, degrees), own, 1)


def squares(loop: ClosedLoop) -> jax.Array:
    """Mean square error."""
    return jnp.mean((loop.run.position - loop.wanted.position) ** 2, axis=-1)


def lanes(controller: AbstractController) -> tuple[tuple[str, ...], jax.Array]:
    """(names of all gains, 2 n + 1 rows of them as they are)."""
    names = tuple(parameters(controller))
    return names, jnp.tile(get_parameters(controller, names), (2 * len(names) + 1, 1))


def test_nvsc_without_a_band_is_vsc3_to_the_bit() -> None:
    nvsc = temperature_vsc(SYSTEM)
    plain = batch(nvsc.vsc, *lanes(nvsc.vsc), jnp.asarray(50.0))
    unbanded = set_parameters(nvsc, {"temperature_band": 0.0})
    without = batch(unbanded, *lanes(unbanded), jnp.asarray(50.0))
    for one, other in zip(jax.tree.leaves(plain), jax.tree.leaves(without), strict=True):
        np.testing.assert_array_equal(one[0], other[0])
    banded = batch(nvsc, *lanes(nvsc), jnp.asarray(50.0))
    assert np.degrees(banded.run.position[0]).max() < np.degrees(plain.run.position[0]).max() - 20.0
    zero = jnp.zeros(())
    assert float(AsPrintedBand().share(zero, zero, zero)) == 0.0
    assert float(AsPrintedBand().share(zero, zero + 1e-9, zero)) == 1.0, "as printed, at rest too"


def test_nvsc_acts_only_while_the_arm_moves_past_and_cools_a_wire_that_is_too_hot() -> None:
    nvsc: TemperatureVsc = dataclasses.replace(temperature_vsc(SYSTEM), temperature_gain=2.0)
    stress, finish = 100e6, 78.0 + 100e6 / 10.3e6
    one, zero = jnp.asarray(1.0), jnp.zeros(())

    def asked(velocity: float, temperature: float, wanted: float) -> tuple[float, float, float]:
        """(NVSC, VSC alone, T_d) at 0 rad, with A_f' standing still."""
        now = MeasuredState(zero, jnp.asarray(velocity), one * stress, one * temperature, zero, zero, zero)
        memory = nvsc.start(now, set_point(wanted))
        volts = nvsc.step(memory, now, set_point(wanted), one * DT)[1]
        alone = nvsc.vsc.step(memory.vsc, now, set_point(wanted), one * DT)[1]
        return float(volts), float(alone), float(nvsc.temperature_wanted(now, set_point(wanted)))

    theta_f = float(nvsc.finish_position)
    assert abs(np.degrees(theta_f) - 89.4) < 1.0
    # On the line from (0, T) to (theta_f, A_f').
    for share in (0.0, 0.5, 1.0):
        assert asked(0.0, 80.0, share * theta_f)[2] == pytest.approx(80.0 + share * (finish - 80.0))
    at_rest, alone, _ = asked(0.0, 80.0, 0.8)
    assert at_rest == alone, "at rest A_f' stands still as well, and the VSC stays"
    down, alone, _ = asked(-9.0, 80.0, 0.8)
    assert down == alone
    fast = float(parameters(nvsc)["passing_speed"].high)
    assert fast > 9.0
    passing, _, wanted = asked(9.0, 85.0, 0.8)
    assert passing == pytest.approx(2.0 * (wanted - 85.0))
    assert asked(9.0, 86.0, 0.8)[0] < passing < asked(9.0, 84.0, 0.8)[0], "the hotter the less"
    assert asked(9.0, 95.0, 0.8)[0] == 0.0 < asked(9.0, 20.0, 0.8)[0] <= 10.0


SMOOTH = {
    "pid": (Pid(9.0, 9.0, 0.9, largest_voltage=10.0, smallest_voltage=3.0, unwinding_time=0.2), 10.0),
    "vsc2": (set_parameters(vsc2(SYSTEM), {"boundary": 0.4}), 0.0),
    "vsc3": (set_parameters(vsc3(SYSTEM), {"surface_slope": 5.0, "boundary": 1.5}), 0.0),
    "nvsc": (set_parameters(temperature_vsc(SYSTEM), {"temperature_band": 90.0}), 30.0),
}


@pytest.mark.parametrize("name", often(SMOOTH, ["pid"]))
def test_derivatives_in_the_gains_agree_with_differences(name: str) -> None:
    controller, degrees = SMOOTH[name][0], jnp.asarray(SMOOTH[name][1])
    names, rows = lanes(controller)
    at, count = rows[0], len(names)
    size = jnp.where(at == 0.0, 1.0, jnp.abs(at))
    moves = 1e-6 * jnp.diag(size)
    around = squares(batch(controller, names, rows + jnp.concatenate([moves, -moves, 0.0 * moves[:1]]), degrees))
    differences = (around[:count] - around[count : 2 * count]) / 2e-6
    found = slopes(controller, names, at, degrees) * size
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, differences, rtol=2e-3, atol=1e-6 * np.abs(found).max(), err_msg=str(names))
    assert (np.abs(found) > 1e-6).sum() >= min(3, len(names)), "a cost that feels none of the gains checks nothing"


def test_derivatives_stay_finite_in_saturation() -> None:
    """Always at the upper limit: only the limit is felt."""
    stuck = Pid(1e3, 0.0, 0.0, largest_voltage=6.0)
    names, rows = lanes(stuck)
    found = dict(zip(names, np.asarray(slopes(stuck, names, rows[0], jnp.asarray(80.0))), strict=True))
    assert abs(found.pop("largest_voltage")) > 0.0
    assert set(found.values()) == {0.0}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_gain_out_of_its_range_is_named(name: str) -> None:
    controller = CONTROLLERS[name]
    gain = next(iter(parameters(controller).values()))
    beyond = set_parameters(controller, {gain.name: -1.0 - abs(gain.low)})
    with pytest.raises(ValueError, match=rf"`{gain.name}` = -{1 + abs(gain.low):g}.*from {gain.low:g} to") as raised:
        simulate_closed_loop(SYSTEM, beyond, jnp.zeros(11), DT)
    assert f"{gain.high:g}" in str(raised.value)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_gain_that_is_no_number_fails_its_own_run_and_no_other(name: str) -> None:
    """Each gain in turn, one lane of a batch each; the other lanes are sound."""
    controller = CONTROLLERS[name]
    names, sound = lanes(controller)
    count = len(names)
    broken = sound.at[jnp.arange(count), jnp.arange(count)].set(jnp.nan)
    # So near the start that the arm is beyond it within the run: V_low is used too.
    found, fine = (batch(controller, names, rows, jnp.asarray(-44.0)) for rows in (broken, sound))
    failed = np.asarray(found.failed_at)
    assert np.isfinite(failed[:count]).all(), f"unseen: {np.array(names)[~np.isfinite(failed[:count])]}"
    assert np.isinf(failed[count:]).all()
    assert np.isinf(fine.failed_at).all()
    for one, other in zip(jax.tree.leaves(found), jax.tree.leaves(fine), strict=True):
        np.testing.assert_array_equal(one[count:], other[count:])
    for series in jax.tree.leaves((found.run, found.voltage)):
        assert np.isfinite(series).all()


def test_presets_have_the_gains_that_were_found() -> None:
    stored: dict[str, Any] = {}
    for name in ("pid", "vsc", "temperature_vsc"):
        stored |= json.loads((GAINS / f"{name}.json").read_text(encoding="utf-8"))
    presets: dict[str, AbstractController] = {
        "tuned_everywhere": pid(SYSTEM),
        "vsc2": vsc2(SYSTEM),
        "vsc3": vsc3(SYSTEM),
        "vsc3_of_section_4_6": vsc3_of_section_4_6(SYSTEM),
        "temperature_vsc": temperature_vsc(SYSTEM),
    } | {f"tuned_at_{angle}_deg": pid_tuned_at(SYSTEM, angle) for angle in PID_TUNED_AT}
    assert set(presets) == set(stored)
    for name, controller in presets.items():
        gains, box = stored[name]["gains"], stored[name]["box"]
        assert set(gains) == set(box)
        np.testing.assert_array_equal(get_parameters(controller, list(gains)), list(gains.values()), err_msg=name)
    with pytest.raises(ValueError, match="0, 10, 40"):
        pid_tuned_at(SYSTEM, 20)
