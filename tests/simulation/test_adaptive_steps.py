"""Steps as long as the error allows: as accurate as asked, fewer, and the same run whatever the samples."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from smajax.core.parameters import set_parameters
from smajax.engine import program
from smajax.model.rigs import arm
from smajax.model.system import initial_state
from smajax.model.types import Inputs, Scalar, State
from smajax.simulation import adaptive_steps
from smajax.simulation.adaptive_steps import advance
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Last
from smajax.simulation.step import step, step_and_error
from tests.helpers.whole_box import whole_box

SECONDS = 4.0
VOLTAGE = np.linspace(5.5, 8.5, 12)  # the fast ones throw the arm past the slack wire
LIGHT = set_parameters(arm(), {"payload_mass": 0.9 * 0.0572})  # none of them meets the upper stop


def _positions(dt: float, tolerance: float | None, every: int) -> tuple[np.ndarray, np.ndarray]:
    keep = ("position", "martensite_fraction")
    axes = zipped(voltage=VOLTAGE)
    found = run_batch(LIGHT, {}, axes, seconds=SECONDS, dt=dt, every=every, keep=keep, tolerance=tolerance)
    return np.degrees(found["position"].to_numpy()), found["martensite_fraction"].to_numpy()


@pytest.fixture(scope="module")
def exact() -> tuple[np.ndarray, np.ndarray]:
    """By fixed steps so short that they are ten times as accurate as what is compared."""
    return _positions(0.00025, None, 200)


@pytest.mark.parametrize(("tolerance", "angle", "fraction"), [(1e-3, 0.2, 4e-4), (1e-4, 0.03, 1e-4)])
def test_a_tolerance_bounds_the_error(exact, tolerance, angle, fraction):
    position, xi = _positions(0.05, tolerance, 1)
    assert np.abs(position - exact[0]).max() < angle
    assert np.abs(xi - exact[1]).max() < fraction


def test_fewer_steps_than_fixed_ones_of_the_same_accuracy():
    """Steps of 5 ms are 0.04 degrees off; these are more accurate, with less than a third of the stages."""

    def counted(model, own):
        inputs = {"voltage": own["voltage"]}
        start = initial_state(model, inputs)

        def one(carry, _):
            state, tried, taken = carry
            state, tried, more = advance(model, state, inputs, jnp.asarray(0.05), tried, jnp.asarray(1e-4))
            return (state, tried, taken + more), None

        (_, _, taken), _ = jax.lax.scan(one, (start, jnp.asarray(0.05), jnp.zeros((), int)), None, 80)
        return {"taken": taken}

    taken = program(counted, LIGHT, ("voltage",), engine="native")(LIGHT, {"voltage": VOLTAGE}, 1)["taken"]
    assert 3 * taken.mean() < 2 * SECONDS / 0.005 / 3


def _walked(scheme: Callable[..., State], begin: State, inputs: Inputs, dt: Scalar, seconds: Scalar | float) -> State:
    """`seconds` after `begin` by equal steps of `dt`."""

    def body(at: tuple[State, Scalar]) -> tuple[State, Scalar]:
        return scheme(at[0], inputs, dt), at[1] + dt

    return jax.lax.while_loop(lambda at: at[1] < seconds - 0.5 * dt, body, (begin, jnp.zeros_like(dt)))[0]


def _order_three(state: State, inputs: Inputs, dt: Scalar) -> State:
    return step_and_error(LIGHT, state, inputs, dt)[0]


def _order_two(state: State, inputs: Inputs, dt: Scalar) -> State:
    return step(LIGHT, state, inputs, dt)


def test_the_scheme_is_of_order_three_where_nothing_bends():
    """An arm under a wire that is heated, before it transforms: error against step."""

    def run(model, own):
        inputs = {"voltage": jnp.asarray(6.0)}
        return _walked(_order_three, initial_state(LIGHT, inputs), inputs, own["dt"], 0.2).wire.temperature

    steps = 0.2 / np.array([10.0, 20.0, 40.0, 2000.0])
    *coarse, best = program(run, None, ("dt",), engine="native")(None, {"dt": steps}, 1)
    errors = np.abs(np.array(coarse) - best)
    assert errors[0] / errors[1] > 6.0
    assert errors[1] / errors[2] > 6.0


@pytest.mark.slow  # a tolerance that bounds the error is above
def test_the_error_estimate_has_the_size_of_the_error():
    """Over 40 ms of an arm on its way, at several moments."""

    def run(model, own):
        inputs = {"voltage": jnp.asarray(7.0)}
        here = _walked(_order_two, initial_state(LIGHT, inputs), inputs, jnp.asarray(0.005), own["at"])
        one, error = step_and_error(LIGHT, here, inputs, jnp.asarray(0.04))
        best = _walked(_order_two, here, inputs, jnp.asarray(0.0001), 0.04)
        return one.motion.position - best.motion.position, error[1]

    off, error = program(run, None, ("at",), engine="native")(None, {"at": np.linspace(1.0, 2.5, 16)}, 1)
    assert (np.abs(off) < 1.5 * np.abs(error)).all()
    assert np.abs(error).max() > 0.0


def test_error_controlled_batches_have_the_requested_samples_and_measures():
    found = run_batch(
        arm(), {}, zipped(voltage=[6.0, 8.0]), seconds=1.0, dt=0.1, measures=(Last("position"),), tolerance=1e-3
    )
    np.testing.assert_allclose(found["time"], np.arange(11) * 0.1)
    np.testing.assert_array_equal(found["last_position"], found["position"][:, -1])
    assert found.attrs["tolerance"] == "0.001"


def test_error_controlled_steps_meet_every_sample_of_the_inputs():
    """A voltage that is off every second tenth of a second."""
    series = np.where(np.arange(41) % 2 == 0, 7.0, 0.0)
    ours = run_batch(arm(), {"voltage": jnp.asarray(series)}, zipped(payload_mass=[0.06]), dt=0.1, tolerance=1e-5)
    fine = np.append(np.repeat(series[:-1], 50), series[-1])
    exact = run_batch(arm(), {"voltage": jnp.asarray(fine)}, zipped(payload_mass=[0.06]), dt=0.002, every=50)
    np.testing.assert_allclose(ours["temperature"], exact["temperature"], atol=2e-3)


@pytest.mark.parametrize("tolerance", [0.0, -1e-4])
def test_a_tolerance_that_is_not_positive_is_refused(tolerance):
    with pytest.raises(ValueError, match="1e-4"):
        run_batch(arm(), {}, zipped(voltage=[6.0]), seconds=1.0, tolerance=tolerance)


@pytest.mark.filterwarnings("ignore:The balance properties of Sobol:UserWarning")
def test_no_wire_of_the_declared_box_takes_steps_without_end():
    """Two of these once did: the last step, longer than the shortest by rounding alone, was refused for ever."""
    dt, system = jnp.asarray(0.02), arm()
    levels = np.zeros(200)
    levels[25:100], levels[125:150] = 9.0, 4.5

    def counted(model, own):
        own_arm = set_parameters(model[0], own)

        def one(carry, voltage):
            state, tried, taken = carry
            state, tried, more = advance(own_arm, state, {"voltage": voltage}, dt, tried, jnp.asarray(1e-4))
            return (state, tried, jnp.maximum(taken, more)), None

        start = initial_state(own_arm, {"voltage": model[1][0]})
        (state, _, taken), _ = jax.lax.scan(one, (start, dt, jnp.zeros((), int)), model[1])
        return {"taken": taken, "time": state.time}

    box, model = whole_box(system, 1024, 1), (system, jnp.asarray(levels))
    found = program(counted, model, tuple(box), engine="native")(model, box, 2)
    assert 500 < found["taken"].max() < 2000
    np.testing.assert_allclose(found["time"], 4.0, rtol=1e-9)  # of molten wires too


def test_a_run_whose_tries_run_out_ends_in_time_and_says_so(monkeypatch):
    monkeypatch.setattr(adaptive_steps, "MOST_STEPS", 2)  # of each of ten parts of the time

    def run(model, own):
        inputs = {"voltage": jnp.asarray(7.0)}
        start = initial_state(model, inputs)
        state, _, taken = advance(model, start, inputs, jnp.asarray(0.5), jnp.asarray(0.5), own["tolerance"])
        return {"taken": taken, "time": state.time, "unsolved": state.unsolved, "heat": state.wire.temperature}

    found = program(run, LIGHT, ("tolerance",), engine="native")(LIGHT, {"tolerance": np.array([1e-4, 1e-9])}, 1)
    assert found["taken"][0] < 20
    assert found["taken"][1] == 21
    np.testing.assert_allclose(found["time"], 0.5, rtol=1e-12)
    assert found["unsolved"].tolist() == [0.0, 1.0]
    assert found["heat"][1] == pytest.approx(found["heat"][0], abs=1.0)
