"""What a control engineer asks of a closed loop, while it runs or of its trajectory: times, overshoot, error, energy."""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from smajax.control.closed_loop import AbstractWatch, ClosedLoop, watch_closed_loop
from smajax.control.controllers.base import AbstractController
from smajax.control.reference import Reference
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System, heating_power
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.model.wire.resistance import resistance_per_metre

BAND_DEGREES = 1.0  # an angle this near the set point counts as there
BAND_SHARE = 0.01  # a length: this share of the stroke that the recoverable strain gives
STEADY = 0.2  # the last share of a run in which the error counts as steady
LIVELY = 0.5  # V: a command that turns back by less has not switched


class Merit(eqx.Module):
    """Figures of merit of one run to one set point. Times are infinite where the run never gets there."""

    reach_time: Scalar  # s, first within the band or beyond the set point
    settling_time: Scalar  # s, in the band from there on, the whole last fifth of the run at least
    overshoot: Scalar  # rad or m, largest distance beyond the set point, seen from the start (any, if it starts there)
    steady_error: Scalar  # rad or m, mean of the absolute error over the last fifth
    steady_offset: Scalar  # rad or m, mean of position - set point there
    energy: Scalar  # J into the wire
    switches_per_second: Scalar  # 1/s, how often the command turns back by more than half a volt
    peak_temperature: Scalar  # C


# Of an arm; the lengths of another load are in m.
MERIT_UNITS = {
    "reach_time": "s",
    "settling_time": "s",
    "overshoot": "rad",
    "steady_error": "rad",
    "steady_offset": "rad",
    "energy": "J",
    "switches_per_second": "1/s",
    "peak_temperature": "degC",
}


def band_of(system: System) -> Scalar:
    """One degree for an angle, one per cent of the stroke for a length; rad or m."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    if load.reading[1] == "rad":
        return jnp.radians(jnp.asarray(BAND_DEGREES))
    return BAND_SHARE * system.wire.constitutive.recoverable_strain / load.contraction(system.wire)


class _Seen(NamedTuple):
    """What `Judge` remembers from sample to sample."""

    number: Scalar  # samples seen
    began: Scalar  # s
    time: Scalar  # s, of the last sample
    side: Scalar  # 1 where the set point is approached from below, -1 from above
    starts_there: Scalar  # bool
    reached: Scalar  # s
    inside_since: Scalar  # s, infinite while outside of the band
    unsettled: Scalar  # bool: outside of it in the steady part
    beyond: Scalar
    steady: Scalar  # samples in the steady part
    error: Scalar  # sum of its absolute errors there
    offset: Scalar  # sum of its errors there
    energy: Scalar
    extreme: Scalar  # V, the highest (lowest) command since the last turn
    rising: Scalar  # 1 up, -1 down, 0 before the first command
    turns: Scalar
    hottest: Scalar


class _Sample(NamedTuple):
    """What is judged of a run at one moment."""

    time: Scalar
    position: Scalar
    temperature: Scalar
    fraction: Scalar
    command: Scalar
    dt: Scalar  # s that the command holds, 0 at the last sample


class Judge(AbstractWatch):
    """Figures of merit while a loop runs, against its last set point."""

    system: System  # the plant that runs
    target: Scalar  # rad or m
    band: Scalar  # rad or m
    samples: int = eqx.field(static=True)

    def begun(self, position: Scalar, time: Scalar) -> _Seen:
        """Before the first sample, which lies at `position`."""
        error = position - self.target
        zero, never = jnp.zeros_like(error), jnp.full_like(error, jnp.inf)
        no, nothing = jnp.zeros_like(error, bool), jnp.zeros_like(error, int)
        return _Seen(
            number=nothing,
            began=time,
            time=time,
            side=jnp.where(error < 0.0, 1.0, -1.0),
            starts_there=jnp.abs(error) <= self.band,
            reached=never,
            inside_since=never,
            unsettled=no,
            beyond=zero,
            steady=zero,
            error=zero,
            offset=zero,
            energy=zero,
            extreme=zero,
            rising=zero,
            turns=nothing,
            hottest=-never,
        )

    def judged(self, seen: _Seen, now: _Sample) -> _Seen:
        """One sample more."""
        error = now.position - self.target
        outside = ~(jnp.abs(error) <= self.band)  # what is no number is not there
        there = seen.side * error >= -self.band
        beyond = jnp.where(seen.starts_there, jnp.abs(error), seen.side * error)
        steady = seen.number >= (1.0 - STEADY) * (self.samples - 1) - 1e-9
        weight = jnp.where(steady, 1.0, 0.0)
        # The highest (lowest) command since it last turned back; the first one counts as on its way up.
        rising = jnp.where(seen.rising == 0.0, 1.0, seen.rising)
        fresh = (seen.rising == 0.0) | (rising * (now.command - seen.extreme) > 0.0)
        extreme = jnp.where(fresh, now.command, seen.extreme)
        turned = rising * (extreme - now.command) > LIVELY
        system = self.system
        ohms = resistance_per_metre(system.wire, system.terms.resistance, now.temperature, now.fraction)
        power = heating_power(system, ohms, system.drive.from_voltage(now.command))
        return _Seen(
            number=seen.number + 1,
            began=seen.began,
            time=now.time,
            side=seen.side,
            starts_there=seen.starts_there,
            reached=jnp.where(there & ~(seen.reached < jnp.inf), now.time, seen.reached),
            inside_since=jnp.where(outside, jnp.inf, jnp.minimum(seen.inside_since, now.time)),
            unsettled=seen.unsettled | (outside & steady),
            beyond=jnp.maximum(seen.beyond, beyond),
            steady=seen.steady + weight,
            error=seen.error + weight * jnp.abs(error),
            offset=seen.offset + weight * error,
            energy=seen.energy + power * system.wire.wire_length * now.dt,
            extreme=jnp.where(turned, now.command, extreme),
            rising=jnp.where(turned, -rising, rising),
            turns=seen.turns + turned,
            hottest=jnp.maximum(seen.hottest, now.temperature),
        )

    def start(self, state: State) -> _Seen:
        return self.begun(state.motion.position, state.time)

    def see(self, memory: _Seen, state: State, command: Scalar, dt: Scalar) -> _Seen:
        wire = state.wire
        now = _Sample(state.time, state.motion.position, wire.temperature, wire.martensite_fraction, command, dt)
        return self.judged(memory, now)

    def result(self, memory: _Seen) -> Merit:
        # A run that is inside at its last sample by chance has not settled.
        return Merit(
            reach_time=memory.reached - memory.began,
            settling_time=jnp.where(memory.unsettled, jnp.inf, memory.inside_since - memory.began),
            overshoot=memory.beyond,
            steady_error=memory.error / memory.steady,
            steady_offset=memory.offset / memory.steady,
            energy=memory.energy,
            switches_per_second=memory.turns / (memory.time - memory.began),
            peak_temperature=memory.hottest,
        )


def judge_of(system: System, wanted: Reference, band: Scalar | float | None = None) -> Judge:
    """What judges a run of the plant `system` against the last set point of `wanted`.

    `band`, rad or m, is how near counts as there; default `band_of` the system.
    """
    held = band_of(system) if band is None else jnp.asarray(band, dtype=float)
    return Judge(system, wanted.position[-1], held, jnp.shape(wanted.position)[0])


def merit(loop: ClosedLoop, system: System, band: Scalar | float | None = None) -> Merit:
    """Judge a run that was simulated; `system` is the plant that ran. Pure: `vmap` it with the loop."""
    return _judged(judge_of(system, loop.wanted, band), loop.run, loop.voltage)


def _judged(judge: Judge, run: Trajectory, voltage: Series) -> Merit:
    held = jnp.append(jnp.diff(run.time), 0.0)
    samples = _Sample(run.time, run.position, run.temperature, run.martensite_fraction, voltage, held)
    seen, _ = lax.scan(
        lambda seen, now: (judge.judged(seen, now), None), judge.begun(run.position[0], run.time[0]), samples
    )
    return judge.result(seen)


class Rest(NamedTuple):
    """A set point from when it is asked to the next one, and what is made of it there."""

    begin: float  # s
    end: float  # s
    set_point: float  # rad or m
    merit: Merit  # times count from `begin`


def rests(set_points: np.ndarray) -> list[tuple[int, int]]:
    """(first sample, last one) of each set point; the last is the next one's first, where its command has done its work."""
    ends = [0, *(np.flatnonzero(np.diff(set_points)) + 1).tolist(), len(set_points) - 1]
    return [(first, last) for first, last in itertools.pairwise(ends) if first < last]


def merit_by_set_point(loop: ClosedLoop, system: System, band: Scalar | float | None = None) -> tuple[Rest, ...]:
    """`merit` of each set point by itself, as if the run began where it is asked and ended where the next is.

    For runs that have been computed: how many there are is in the values.
    """
    held, judged = band_of(system) if band is None else jnp.asarray(band, dtype=float), eqx.filter_jit(_judged)
    time, asked = np.asarray(loop.run.time), np.asarray(loop.wanted.position)
    found = []
    for first, last in rests(asked):
        run = jax.tree.map(lambda series, part=slice(first, last + 1): series[part], loop.run)
        voltage = jnp.asarray(loop.voltage)[first : last + 1].at[-1].set(loop.voltage[last - 1])
        judge = Judge(system, jnp.asarray(asked[first]), held, last - first + 1)
        one = jax.tree.map(np.asarray, judged(judge, run, voltage))
        found.append(Rest(float(time[first]), float(time[last]), float(asked[first]), one))
    return tuple(found)


def judged_loop(
    system: System, controller: AbstractController, wanted: Reference, *settings: Any, **interface: Any
) -> tuple[Merit, Scalar]:
    """(figures of merit, `failed_at`) of a loop, of which nothing else is stored; arguments as `simulate_closed_loop`'s."""
    found, failed = watch_closed_loop(judge_of(system, wanted), system, controller, wanted, *settings, **interface)
    return found, failed
