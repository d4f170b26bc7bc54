"""A system under a sampled controller -> a trajectory. `jit`, `vmap` and `grad` stay outside, as in `simulate`."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.controller_call import begun, check_is_controller, commanded
from smajax.control.controllers.base import AbstractController
from smajax.control.estimators.base import AbstractEstimator
from smajax.control.measured_state import MeasuredState, Sensor, truth
from smajax.control.reference import Reference, resting
from smajax.core.names import listed
from smajax.core.parameters import check_bounds, inside_bounds
from smajax.model.system import System, initial_state
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.simulation.input_delay import refuse_lag
from smajax.simulation.integrate import (
    AbstractObserver,
    Carry,
    Control,
    Controlled,
    March,
    Observed,
    Period,
    Schedule,
    Step,
    integrate,
)
from smajax.simulation.observers import StateTrace
from smajax.simulation.simulate import DEFAULT_STEP, check_finite, check_step, trajectory
from smajax.simulation.steppers import ONE_STEP, Integration, stepper_of


class ClosedLoop(eqx.Module):
    """A controlled run: the states at t_0 ... t_{n-1}, and what holds from each of them on, arrays of shape (n,)."""

    run: Trajectory
    wanted: Reference
    voltage: Series  # the controller's command, as it reaches the amplifier: V, or A or W of such a drive
    measured: MeasuredState  # what the controller measured
    failed_at: Scalar  # s, when the command was first not finite, from where on the drive gets 0 V; else inf
    reading: Series  # rad or m: what the `sensor` says, noise and steps with it, once a control period and held; without one `run.reading`


def as_reference(wanted: Reference | Series) -> Reference:
    """Set points where it is a plain array."""
    return wanted if isinstance(wanted, Reference) else resting(wanted)


def _seconds(dt: Scalar | float) -> Scalar:
    check_step(dt)
    return jnp.asarray(dt, dtype=float)


class ClosedLoopSetup(eqx.Module):
    """All that a closed loop is made of; fields as the arguments of `simulate_closed_loop`."""

    system: System
    controller: AbstractController
    wanted: Reference = eqx.field(converter=as_reference)
    dt: Scalar = eqx.field(converter=_seconds, default=DEFAULT_STEP)
    every: int = eqx.field(static=True, default=1)
    estimator: AbstractEstimator | None = None
    sensor: Sensor | None = None
    key: jax.Array | None = None
    delay: int = eqx.field(static=True, default=0)
    disturbance: Mapping[str, Series] | None = None
    initial: State | None = None
    integration: Integration = ONE_STEP  # how finely between two samples
    assumed: System | None = (
        None  # the plant as the controller knows it, by whose drive a command becomes an input; None: as it is
    )

    @property
    def known(self) -> System:
        """The plant as the controller knows it."""
        return self.system if self.assumed is None else self.assumed

    @property
    def samples(self) -> int:
        """How many, of set points and states."""
        return jnp.shape(self.wanted.position)[0]

    @property
    def periods(self) -> int:
        """How many control periods."""
        return (self.samples - 1) // self.every

    @property
    def disturbances(self) -> dict[str, Series]:
        """By channel, each of shape (samples,)."""
        return {name: jnp.asarray(series, dtype=float) for name, series in (self.disturbance or {}).items()}

    def start(self) -> State:
        """The first state: `initial`, or rest with the first disturbances and 0 V."""
        if self.initial is not None:
            return self.initial
        inputs = self.known.drive.from_command(jnp.zeros(()))
        return initial_state(self.system, {**inputs, **{name: one[0] for name, one in self.disturbances.items()}})

    def check(self) -> None:
        """ValueError for what is out of bounds, of another length, or not finite where it is known."""
        check_is_controller(self.controller)
        check_bounds(self.system)
        check_bounds(self.controller)
        refuse_lag(self.system, "a closed loop")
        shape = jnp.shape(self.wanted.position)
        if len(shape) != 1:
            raise ValueError(
                f"`wanted` has the shape {shape}; expected a series, as `reference.constant(reference.clock(seconds, dt), 0.5)` gives it."
            )
        check_finite("the set point `wanted`", self.wanted.position)
        if self.every < 1 or (self.samples - 1) % self.every:
            raise ValueError(
                f"`wanted` has {self.samples} samples and the controller is called every {self.every}: give a multiple of {self.every} "
                "and one sample more, so that the run ends with a whole control period."
            )
        if self.delay < 0:
            raise ValueError(f"`delay` is a whole number of control periods, 0 or more, not {self.delay}.")
        if self.sensor is not None and self.key is None:
            raise ValueError("a sensor draws noise: give `key`, for instance `jax.random.key(0)`.")
        if self.sensor is not None:
            check_bounds(self.sensor)
        load = self.system.load
        if lacking := sorted(load.inputs_required - self.disturbances.keys()):
            raise ValueError(
                f"the load {type(load).__name__} needs the input {listed(lacking)}: give `disturbance={{'{lacking[0]}': values}}`, one a sample."
            )
        known = load.inputs_optional | load.inputs_required | {"ambient_temperature"}
        for name, series in self.disturbances.items():
            if name not in known:
                raise ValueError(f"`{name}` is no disturbance of this system; there are {listed(sorted(known))}.")
            check_finite(f"the disturbance `{name}`", series)
            if series.shape != (self.samples,):
                raise ValueError(
                    f"disturbance `{name}` has the shape {series.shape}, `wanted` has {self.samples} samples."
                )


class Command(NamedTuple):
    """What a controller asks for, held for a control period."""

    voltage: Scalar  # V, at the amplifier
    dt: Scalar  # s, of a step
    inputs: Mapping[str, Scalar]  # of the drive, by channel


class ControlMemory(NamedTuple):
    """What goes from one control period to the next."""

    estimate: Any  # the estimator's memory
    controller: Any  # the controller's
    held: Scalar  # V, the command at the amplifier
    queue: Series  # V, commands on their way to the amplifier, shape (delay,)
    failed_at: Scalar


class AbstractLoopObserver(AbstractObserver):
    """What is made of a closed loop while it runs, so that a sweep stores no trajectory. `see` is called once a sample."""

    @abc.abstractmethod
    def see(self, memory: Any, state: State, voltage: Scalar, dt: Scalar) -> Any:
        """The memory after a sample; `voltage` (V) is held from it on for `dt` seconds, 0 at the last one."""

    @abc.abstractmethod
    def summary(self, memory: Any) -> Any:
        """What was observed, any pytree."""

    def update(self, memory: Any, step: Step) -> Any:
        command = step.inputs.held
        return self.see(memory, step.before, command.voltage, command.dt)

    def result(self, run: Observed) -> Any:
        held = run.control.held
        return self.summary(self.see(run.memory, run.end, held, jnp.zeros_like(held)))


class _ControlTrace(AbstractObserver):
    """(command, measured state, reading) of every period, leaves of shape (periods,)."""

    per_period: ClassVar[bool] = True

    def sample(self, now: Period) -> Any:
        return now.shown

    def result(self, run: Observed) -> Any:
        return run.samples


def simulate_closed_loop(  # the public form: what goes inwards is a `ClosedLoopSetup`
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
    integration: Integration = ONE_STEP,
    assumed: System | None = None,
) -> ClosedLoop:
    """Simulate over the samples of `wanted` (rad or m), `dt` seconds apart; the controller is called `every` samples.

    `dt` is that of the clock by which `wanted` was made: a series carries no times, so another one stretches the run.

    Its command is held in between, as a digital controller holds it, and reaches the amplifier `delay` control periods
    later. Without an `estimator` it measures the true state, with the position as `sensor` (with noise drawn from `key`)
    reads it. `disturbance` are further inputs of the system, such as `load_torque`, `added_mass` or `ambient_temperature`, each of
    shape (n,). A plain array for `wanted` means set points (`reference.resting`). `initial` defaults to rest.
    `integration`: how finely between two samples; error-controlled steps have derivatives in forward mode alone. `assumed`: the plant as
    the controller knows it, by whose drive a command becomes an input (a duty goes by the supply that is believed to be there); default the plant itself.

    Raises ValueError when a gain, a parameter or the sensor's noise lies outside its bounds, when `dt` is not positive or a set point
    not finite (where values are known: outside of `jit`), when `wanted` is not a whole number of control periods and one sample more, and when noise has no `key`; TypeError for what is no controller, and
    one whose `step` JAX cannot trace (`controller_call.commanded`).
    """
    between = (estimator, sensor, key, delay, disturbance)
    return stored_loop(ClosedLoopSetup(system, controller, wanted, dt, every, *between, initial, integration, assumed))


def stored_loop(setup: ClosedLoopSetup) -> ClosedLoop:
    """`simulate_closed_loop` of its arguments."""
    run = _march(setup, (StateTrace(), _ControlTrace()))
    states, (voltage, measured, reading) = run.results
    spread = lambda series: jnp.append(jnp.repeat(series, setup.every), series[-1])  # noqa: E731
    measured = jax.tree.map(spread, measured)
    series = trajectory(states)
    read = series.reading if setup.sensor is None else spread(reading)
    return ClosedLoop(series, setup.wanted, spread(voltage), measured, run.control.failed_at, read)


def observe_closed_loop(observer: AbstractObserver, setup: ClosedLoopSetup) -> tuple[Any, Scalar]:
    """(what `observer` gives, `failed_at`) of the loop that `simulate_closed_loop` simulates: nothing else is stored."""
    run = _march(setup, (observer,))
    return run.results[0], run.control.failed_at


def _march(setup: ClosedLoopSetup, observers: Sequence[AbstractObserver]) -> March:
    setup.check()
    plant = stepper_of(setup.system, setup.dt, setup.integration)

    def advance(carry: Carry, inputs: Controlled) -> Carry:
        return plant(carry, {**inputs.held.inputs, **inputs.now})

    state = setup.start()
    acting = {name: series[:-1] for name, series in setup.disturbances.items()}
    schedule = Schedule(setup.samples - 1, setup.every)
    return integrate(advance, plant.start(state, {}), acting, schedule, observers, _control(setup, state))


def _control(setup: ClosedLoopSetup, start: State) -> Control:
    """Sensor, estimator, controller and delay, once a control period."""
    controller, estimator, sensor = setup.controller, setup.estimator, setup.sensor
    period = setup.dt * setup.every
    periods = setup.periods
    noise = jnp.zeros(periods) if setup.key is None else jax.random.normal(setup.key, (periods,))

    def reading_of(state: State, noise: Scalar) -> Scalar:
        return state.reading if sensor is None else sensor.reading(state.reading, noise)

    def with_reading(state: State, reading: Scalar) -> MeasuredState:
        return eqx.tree_at(lambda measured: measured.position, truth(state), reading)

    def step(memory: ControlMemory, state: State, sample: tuple[Reference, Scalar, Scalar]) -> tuple[Any, Any, Any]:
        wanted, noise, number = sample
        reading = reading_of(state, noise)
        if estimator is None:
            estimate, measured = memory.estimate, with_reading(state, reading)
        else:
            # The first reading has already been used to begin with.
            later, after = estimator.step(memory.estimate, reading, memory.held, period)
            at_start = number == 0
            pick = lambda one, other: jnp.where(at_start, one, other)  # noqa: E731
            estimate = jax.tree.map(pick, memory.estimate, later)
            measured = jax.tree.map(pick, estimator.start(reading)[1], after)
        own, answer = commanded(controller, memory.controller, measured, wanted, period)
        failed_at = jnp.minimum(memory.failed_at, jnp.where(jnp.isfinite(answer), jnp.inf, state.time))
        queue = jnp.append(memory.queue, jnp.where(jnp.isfinite(failed_at), 0.0, answer))
        held, queue = queue[0], queue[1:]
        command = Command(held, setup.dt, setup.known.drive.from_command(held))
        return ControlMemory(estimate, own, held, queue, failed_at), command, (held, measured, reading)

    reading = reading_of(start, noise[0])
    estimate, measured = (None, with_reading(start, reading)) if estimator is None else estimator.start(reading)
    memory = ControlMemory(
        estimate,
        begun(controller, measured, jax.tree.map(lambda series: series[0], setup.wanted)),
        jnp.zeros(()),
        jnp.zeros(setup.delay),
        jnp.where(inside_bounds(controller), jnp.inf, start.time),
    )
    at_calls = jax.tree.map(lambda series: series[: -1 : setup.every], setup.wanted)
    return Control(step, memory, (at_calls, noise, jnp.arange(periods)))


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
