"""The one march in time: observers see every step, periods change nothing, and nothing else scans over time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import smajax
from smajax.simulation.integrate import (
    AbstractObserver,
    Carry,
    Control,
    Controlled,
    Observed,
    Period,
    Schedule,
    Step,
    integrate,
)
from smajax.simulation.observers import StateTrace

INPUTS = jnp.linspace(0.0, 1.0, 12)


class Total(AbstractObserver):
    """The sum of before + 10 input + 100 after."""

    def init(self, state: jax.Array) -> jax.Array:
        return jnp.zeros_like(state)

    def update(self, memory: jax.Array, step: Step) -> jax.Array:
        return memory + step.before + 10.0 * step.inputs + 100.0 * step.after


class Ends(AbstractObserver):
    """The state at the end of every period, and of the run."""

    per_period: ClassVar[bool] = True

    def sample(self, now: Period) -> jax.Array:
        return now.after

    def result(self, run: Observed) -> Any:
        return run.samples, run.end


def _advance(carry: Carry, now: jax.Array) -> Carry:
    return Carry(jnp.sin(carry.state) + now, carry.memory)


def _expected() -> np.ndarray:
    states = [0.3]
    for now in np.asarray(INPUTS):
        states.append(np.sin(states[-1]) + now)
    return np.asarray(states)


@pytest.mark.parametrize("checkpointed", [False, True])
@pytest.mark.parametrize("every", [1, 3, 6, 12])
def test_observers_see_every_step_and_period(every: int, checkpointed: bool) -> None:
    schedule = Schedule(12, every, checkpointed)
    observers = (StateTrace(), Total(), Ends())
    run = integrate(_advance, Carry(jnp.asarray(0.3)), INPUTS, schedule, observers)
    trace, total, (ends, end) = run.results
    states = _expected()
    np.testing.assert_allclose(trace, states, rtol=1e-14)
    np.testing.assert_allclose(total, (states[:-1] + 10.0 * np.asarray(INPUTS) + 100.0 * states[1:]).sum(), rtol=1e-14)
    np.testing.assert_allclose(ends, states[every::every], rtol=1e-14)
    assert float(end) == float(run.end.state) == pytest.approx(states[-1], rel=1e-14)


def test_without_observers_there_is_the_last_state_alone() -> None:
    run = integrate(_advance, Carry(jnp.asarray(0.3)), INPUTS, Schedule(12))
    assert run.results == ()
    assert float(run.end.state) == pytest.approx(_expected()[-1], rel=1e-14)


@pytest.mark.parametrize("every", [1, 4])
def test_a_control_acts_once_a_period_and_holds(every: int) -> None:
    """It sees the state at the beginning of its period; the steps and the observers see what it holds."""

    def control(memory: jax.Array, state: jax.Array, sample: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
        held = sample - state
        return memory + 1, held, state

    def advance(carry: Carry, given: Controlled) -> Carry:
        return Carry(carry.state + 0.5 * given.held + 0.0 * given.now)

    class Held(AbstractObserver):
        def sample(self, now: Step) -> jax.Array:
            return now.inputs.held

        def result(self, run: Observed) -> Any:
            return run.samples, run.control

    wanted = jnp.arange(12.0 // every)
    setup = Control(control, jnp.asarray(0), wanted)
    run = integrate(advance, Carry(jnp.asarray(2.0)), INPUTS, Schedule(12, every), (Held(), StateTrace()), setup)
    (held, calls), states = run.results
    state, expected, trace = 2.0, [], [2.0]
    for number in range(12):
        if number % every == 0:
            now = number // every - state
        expected.append(now)
        state += 0.5 * now
        trace.append(state)
    np.testing.assert_allclose(held, expected, rtol=1e-14)
    np.testing.assert_allclose(states, trace, rtol=1e-14)
    assert int(calls) == int(run.control) == 12 // every


def test_only_integrate_marches_in_time() -> None:
    """Loops of these rooms: `integrate`, the stages of one step, the delay of input series, a curve over temperature, and the rounds of a bounded least squares."""
    root = Path(smajax.__file__).parent
    scanning = {
        path.relative_to(root).as_posix()
        for room in ("simulation", "control")
        for path in (root / room).rglob("*.py")
        if re.search(r"\b(checkpointed_scan|scan|fori_loop)\(", path.read_text())
    }
    assert scanning == {
        "simulation/integrate.py",
        "simulation/step.py",
        "simulation/input_delay.py",
        "control/controllers/quasi_static.py",
        "control/controllers/receding_horizon.py",
    }
