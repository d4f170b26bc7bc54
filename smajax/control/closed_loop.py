"""A system under a sampled controller -> a trajectory. `jit`, `vmap` and `grad` stay outside, as in `simulate`."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import MeasuredState, Sensor, truth
from smajax.control.reference import Reference, resting
from smajax.core.names import listed
from smajax.core.parameters import check_bounds, inside_bounds
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.simulation.input_delay import refuse_lag
from smajax.simulation.simulate import DEFAULT_STEP, check_finite, check_step, trajectory
from smajax.simulation.step import step


class ClosedLoop(eqx.Module):
    """A controlled run: the states at t_0 ... t_{n-1}, and what holds from each of them on, arrays of shape (n,)."""

    run: Trajectory
    wanted: Reference
    voltage: Series  # the controller's command, as it reaches the amplifier
    measured: MeasuredState  # what the controller was told
    failed_at: Scalar  # s, when the controller first answered with no number, from where on it gets 0 V; else inf


class AbstractWatch(eqx.Module):
    """What looks on while a loop runs, so that a sweep stores no trajectory. `see` is called once a sample."""

    @abc.abstractmethod
    def start(self, state: State) -> Any:
        """The memory before the first sample, which is `state`."""

    @abc.abstractmethod
    def see(self, memory: Any, state: State, command: Scalar, dt: Scalar) -> Any:
        """The memory after a sample; `command` (V) holds from it on for `dt` seconds, 0 at the last one."""

    @abc.abstractmethod
    def result(self, memory: Any) -> Any:
        """What it has seen, any pytree."""


class _Nobody(AbstractWatch):
    def start(self, state: State) -> None:
        return None

    def see(self, memory: None, state: State, command: Scalar, dt: Scalar) -> None:
        return None

    def result(self, memory: None) -> None:
        return None


class _Carry(NamedTuple):
    state: State
    estimate: Any  # the estimator's memory
    memory: Any  # the controller's
    held: Scalar  # V, the command at the amplifier
    queue: Series  # V, commands on their way to the amplifier, shape (delay,)
    failed_at: Scalar
    seen: Any  # the watch's memory


def simulate_closed_loop(
    system: System,
    controller: AbstractController,
    wanted: Reference | Series,
    dt: Scalar | float = DEFAULT_STEP,
    every: int = 1,
    *,
    estimator: AbstractEstimator | None = None,
    sensor: Sensor | None = None,
    key: jax.Array | None = None,
    delay: int = 0,
    disturbance: Mapping[str, Series] | None = None,
    initial: State | None = None,
) -> ClosedLoop:
    """Simulate over the samples of `wanted` (rad or m), `dt` seconds apart; the controller is called `every` samples.

    `dt` is that of the clock by which `wanted` was made: a series carries no times, so another one stretches the run.

    Its command is held in between, as a digital controller holds it, and reaches the amplifier `delay` control periods
    later. Without an `estimator` it is told the true state, with the position as `sensor` (with noise drawn from `key`)
    reads it. `disturbance` are further inputs of the system, such as `load_torque` or `ambient_temperature`, each of
    shape (n,). A plain array for `wanted` means set points (`reference.resting`). `initial` defaults to rest.

    Raises ValueError when a gain, a parameter or the sensor's noise lies outside its bounds, when `dt` is none or a set point
    not finite (where values are known: outside of `jit`), when `wanted` has not a whole number of control periods and one sample more, and when noise has no `key`.
    """
    first, end, (states, held, measured), wanted = _run(
        system, controller, wanted, dt, every, _Nobody(), True, estimator, sensor, key, delay, disturbance, initial
    )
    states = jax.tree.map(lambda rest: rest.reshape(-1, *rest.shape[2:]), states)
    spread = lambda series: jnp.append(jnp.repeat(series, every), series[-1])  # noqa: E731
    return ClosedLoop(trajectory(first, states), wanted, spread(held), jax.tree.map(spread, measured), end.failed_at)


def watch_closed_loop(
    watch: AbstractWatch,
    system: System,
    controller: AbstractController,
    wanted: Reference | Series,
    dt: Scalar | float = DEFAULT_STEP,
    every: int = 1,
    *,
    estimator: AbstractEstimator | None = None,
    sensor: Sensor | None = None,
    key: jax.Array | None = None,
    delay: int = 0,
    disturbance: Mapping[str, Series] | None = None,
    initial: State | None = None,
) -> tuple[Any, Scalar]:
    """(what `watch` has seen, `failed_at`) of the loop that `simulate_closed_loop` simulates: nothing else is stored."""
    _, end, _, _ = _run(
        system, controller, wanted, dt, every, watch, False, estimator, sensor, key, delay, disturbance, initial
    )
    return watch.result(watch.see(end.seen, end.state, end.held, jnp.zeros_like(end.held))), end.failed_at


def _run(
    system: System,
    controller: AbstractController,
    wanted: Reference | Series,
    dt: Scalar | float,
    every: int,
    watch: AbstractWatch,
    kept: bool,
    estimator: AbstractEstimator | None,
    sensor: Sensor | None,
    key: jax.Array | None,
    delay: int,
    disturbance: Mapping[str, Series] | None,
    initial: State | None,
) -> tuple[State, _Carry, Any, Reference]:
    """(first state, end, (states, commands, measured) of every period where they are `kept`, what was wanted)."""
    check_bounds(system)
    check_bounds(controller)
    check_step(dt)
    refuse_lag(system, "a closed loop")
    wanted = wanted if isinstance(wanted, Reference) else resting(wanted)
    shape = jnp.shape(wanted.position)
    if len(shape) != 1:
        raise ValueError(
            f"`wanted` has the shape {shape}; expected a series, as `reference.constant(reference.clock(seconds, dt), 0.5)` gives it."
        )
    check_finite("the set point `wanted`", wanted.position)
    (count,) = shape
    if every < 1 or (count - 1) % every:
        raise ValueError(
            f"`wanted` has {count} samples and the controller is called every {every}: give a multiple of {every} and "
            "one sample more, so that the run ends with a whole control period."
        )
    if delay < 0:
        raise ValueError(f"`delay` is a whole number of control periods, 0 or more, not {delay}.")
    if sensor is not None and key is None:
        raise ValueError("a sensor draws noise: give `key`, for instance `jax.random.key(0)`.")
    if sensor is not None:
        check_bounds(sensor)
    disturbance = {name: jnp.asarray(series, dtype=float) for name, series in (disturbance or {}).items()}
    for name, series in disturbance.items():
        if name not in system.load.inputs_optional | {"ambient_temperature"}:
            raise ValueError(
                f"`{name}` is no disturbance of this system; there are "
                f"{listed(sorted(system.load.inputs_optional | {'ambient_temperature'}))}."
            )
        check_finite(f"the disturbance `{name}`", series)
        if series.shape != (count,):
            raise ValueError(f"disturbance `{name}` has the shape {series.shape}, `wanted` has {count} samples.")

    periods = (count - 1) // every
    period = jnp.asarray(dt, dtype=float) * every
    noise = jnp.zeros(periods) if key is None else jax.random.normal(key, (periods,))
    # Shape (periods, every): what holds in each step of each period.
    acting = {name: series[:-1].reshape(periods, every) for name, series in disturbance.items()}
    first = jax.tree.map(lambda series: series[0], wanted)
    zero = jnp.zeros(())
    at_rest = {**system.drive.from_voltage(zero), **{name: series[0] for name, series in disturbance.items()}}
    state = initial_state(system, at_rest) if initial is None else initial

    def seen(state: State, noise: Scalar) -> Scalar:
        return state.reading if sensor is None else sensor.reading(state.reading, noise)

    def told(state: State, reading: Scalar) -> MeasuredState:
        return eqx.tree_at(lambda measured: measured.position, truth(state), reading)

    def period_of(carry: _Carry, now: tuple[Reference, Scalar, dict[str, Series], Scalar]) -> tuple[_Carry, Any]:
        now_wanted, now_noise, now_acting, number = now
        state = carry.state
        reading = seen(state, now_noise)
        if estimator is None:
            estimate, measured = carry.estimate, told(state, reading)
        else:
            # The first reading has already been used to begin with.
            later, after = estimator.step(carry.estimate, reading, carry.held, period)
            at_start = number == 0
            pick = lambda one, other: jnp.where(at_start, one, other)  # noqa: E731
            estimate = jax.tree.map(pick, carry.estimate, later)
            measured = jax.tree.map(pick, estimator.start(reading)[1], after)
        memory, asked = controller.step(carry.memory, measured, now_wanted, period)
        failed_at = jnp.minimum(carry.failed_at, jnp.where(jnp.isfinite(asked), jnp.inf, state.time))
        asked = jnp.where(jnp.isfinite(failed_at), 0.0, asked)
        queue = jnp.append(carry.queue, asked)
        held, queue = queue[0], queue[1:]
        inputs = system.drive.from_voltage(held)

        def body(carry: tuple[State, Any], acting: dict[str, Scalar]) -> tuple[tuple[State, Any], State | None]:
            state, seen = carry
            seen = watch.see(seen, state, held, jnp.asarray(dt, dtype=float))
            new = step(system, state, {**inputs, **acting}, dt)
            return (new, seen), new if kept else None

        (state, seen_now), states = lax.scan(body, (state, carry.seen), now_acting, length=every)
        shown = (states, held, measured) if kept else None
        return _Carry(state, estimate, memory, held, queue, failed_at, seen_now), shown

    reading = seen(state, noise[0])
    estimate, measured = (None, told(state, reading)) if estimator is None else estimator.start(reading)
    start = _Carry(
        state,
        estimate,
        controller.start(measured, first),
        zero,
        jnp.zeros(delay),
        jnp.where(inside_bounds(controller), jnp.inf, state.time),
        watch.start(state),
    )
    at_calls = jax.tree.map(lambda series: series[:-1:every], wanted)
    end, shown = lax.scan(period_of, start, (at_calls, noise, acting, jnp.arange(periods)))
    return state, end, shown if kept else (None, None, None), wanted


def check_answers(loop: ClosedLoop) -> None:
    """ValueError when a controller answered with a number that is none; for runs that have been computed.

    In a batch the others are not touched: each run has its own `failed_at`.
    """
    failed = np.atleast_1d(np.asarray(loop.failed_at))
    bad = np.flatnonzero(np.isfinite(failed))
    if bad.size:
        where = "" if failed.size == 1 else f" (run {bad[0]} of {failed.size}, and {bad.size - 1} others)"
        raise ValueError(
            f"the controller's answer at {failed[bad[0]]:.3f} s is not a finite voltage, or a gain is out of its bounds{where}; "
            "from there on 0 V was applied. `parameters.check_bounds(controller)` names the gain, its value and its bounds."
        )
