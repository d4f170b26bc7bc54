"""What a control engineer asks of a closed loop, while it runs or of its trajectory: times, overshoot, error, energy."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.control.closed_loop import AbstractLoopObserver, ClosedLoop, ClosedLoopSetup, observe_closed_loop
from smajax.control.reference import Reference
from smajax.model.drive.base import AbstractDrive
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.system import System, heating_power
from smajax.model.types import Scalar, Series, State, Trajectory
from smajax.model.wire.resistance import resistance_per_metre
from smajax.simulation.integrate import AbstractObserver, Carry, Observed, Schedule, Step, integrate

BAND_DEGREES = 1.0  # an angle this near the set point counts as there
BAND_SHARE = 0.01  # a length: this share of the stroke that the recoverable strain gives
STEADY_SHARE = 0.2  # the last share of a run in which the error counts as steady
SWITCH_THRESHOLD = (
    0.5  # V: a command that turns back by less has not switched; of a current or a power what it gives in the wire
)


class Merit(eqx.Module):
    """Figures of merit of one run to one set point. Times are infinite where the run never gets there."""

    reach_time: Scalar  # s, first within the band or beyond the set point
    settling_time: Scalar  # s, in the band from there on, the whole last fifth of the run at least
    overshoot: Scalar  # rad or m, largest distance beyond the set point, away from the start (on either side, if it starts there)
    steady_error: Scalar  # rad or m, mean of the absolute error over the last fifth
    steady_offset: Scalar  # rad or m, mean of position - set point there
    energy: Scalar  # J into the wire
    switches_per_second: Scalar  # 1/s, how often the command turns back by more than `SWITCH_THRESHOLD`
    peak_temperature: Scalar  # C

    def __repr__(self) -> str:
        """The numbers, of one run or of several; of what is traced, the kinds."""
        known = jax.Array | np.ndarray | np.generic | float
        if any(isinstance(one, jax.core.Tracer) or not isinstance(one, known) for one in vars(self).values()):
            return super().__repr__()
        shown = ", ".join(
            f"{name}={np.array2string(np.asarray(one), precision=4, threshold=8, separator=', ')}"
            for name, one in vars(self).items()
        )
        return f"Merit({shown})"


# Of an arm.
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


def merit_units(position: str) -> dict[str, str]:
    """`MERIT_UNITS` of a load whose position is in this unit."""
    return {name: position if unit == "rad" else unit for name, unit in MERIT_UNITS.items()}


def band_of(system: System) -> Scalar:
    """One degree for an angle, one per cent of the stroke for a length; rad or m."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    if load.reading[1] == "rad":
        return jnp.radians(jnp.asarray(BAND_DEGREES))
    return BAND_SHARE * system.wire.constitutive.recoverable_strain / load.contraction(system.wire)


def switch_threshold(system: System, ohms: Scalar) -> Scalar | float:
    """`SWITCH_THRESHOLD` in the unit of the drive's command; `ohms` is the wire's resistance per metre."""
    unit, whole = system.drive.command[1], ohms * system.wire.wire_length
    return {"A": SWITCH_THRESHOLD / whole, "W": SWITCH_THRESHOLD**2 / whole}.get(unit, SWITCH_THRESHOLD)


class MeritMemory(NamedTuple):
    """What `MeritObserver` remembers from sample to sample."""

    number: Scalar  # samples so far
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
    """What figures of merit take of a run at one sample."""

    time: Scalar
    position: Scalar
    temperature: Scalar
    fraction: Scalar
    command: Scalar
    dt: Scalar  # s that the command holds, 0 at the last sample


class MeritObserver(AbstractLoopObserver):
    """Figures of merit while a loop runs, against its last set point."""

    system: System  # the plant that runs
    drive: AbstractDrive  # by which a command became an input
    target: Scalar  # rad or m
    band: Scalar  # rad or m
    samples: int = eqx.field(static=True)

    def first(self, position: Scalar, time: Scalar) -> MeritMemory:
        """Before the first sample, which lies at `position`."""
        error = position - self.target
        zero, never = jnp.zeros_like(error), jnp.full_like(error, jnp.inf)
        no, nothing = jnp.zeros_like(error, bool), jnp.zeros_like(error, int)
        return MeritMemory(
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

    def scored(self, memory: MeritMemory, now: _Sample) -> MeritMemory:
        """One sample more."""
        error = now.position - self.target
        outside = ~(jnp.abs(error) <= self.band)  # what is no number is not there
        there = memory.side * error >= -self.band
        beyond = jnp.where(memory.starts_there, jnp.abs(error), memory.side * error)
        steady = memory.number >= (1.0 - STEADY_SHARE) * (self.samples - 1) - 1e-9
        weight = jnp.where(steady, 1.0, 0.0)
        # The highest (lowest) command since it last turned back; the first one counts as on its way up.
        rising = jnp.where(memory.rising == 0.0, 1.0, memory.rising)
        fresh = (memory.rising == 0.0) | (rising * (now.command - memory.extreme) > 0.0)
        extreme = jnp.where(fresh, now.command, memory.extreme)
        system = self.system
        ohms = resistance_per_metre(system.wire, system.terms.resistance, now.temperature, now.fraction)
        turned = rising * (extreme - now.command) > switch_threshold(system, ohms)
        power = heating_power(system, ohms, self.drive.from_command(now.command))
        return MeritMemory(
            number=memory.number + 1,
            began=memory.began,
            time=now.time,
            side=memory.side,
            starts_there=memory.starts_there,
            reached=jnp.where(there & ~(memory.reached < jnp.inf), now.time, memory.reached),
            inside_since=jnp.where(outside, jnp.inf, jnp.minimum(memory.inside_since, now.time)),
            unsettled=memory.unsettled | (outside & steady),
            beyond=jnp.maximum(memory.beyond, beyond),
            steady=memory.steady + weight,
            error=memory.error + weight * jnp.abs(error),
            offset=memory.offset + weight * error,
            energy=memory.energy + power * system.wire.wire_length * now.dt,
            extreme=jnp.where(turned, now.command, extreme),
            rising=jnp.where(turned, -rising, rising),
            turns=memory.turns + turned,
            hottest=jnp.maximum(memory.hottest, now.temperature),
        )

    def init(self, state: State) -> MeritMemory:
        return self.first(state.motion.position, state.time)

    def see(self, memory: MeritMemory, state: State, voltage: Scalar, dt: Scalar) -> MeritMemory:
        wire = state.wire
        now = _Sample(state.time, state.motion.position, wire.temperature, wire.martensite_fraction, voltage, dt)
        return self.scored(memory, now)

    def summary(self, memory: MeritMemory) -> Merit:
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


def merit_observer(
    system: System, wanted: Reference, band: Scalar | float | None = None, assumed: System | None = None
) -> MeritObserver:
    """The observer of a run of the plant `system` against the last set point of `wanted`.

    `assumed`: the plant as the controller knew it (`ClosedLoopSetup`), default the plant. `band`, rad or m, is how near counts as
    there; default `band_of` what is assumed, so that it is the same for all plants of a sweep.
    """
    known = system if assumed is None else assumed
    held = band_of(known) if band is None else jnp.asarray(band, dtype=float)
    return MeritObserver(system, known.drive, wanted.position[-1], held, jnp.shape(wanted.position)[0])


def merit(loop: ClosedLoop, system: System, band: Scalar | float | None = None, assumed: System | None = None) -> Merit:
    """Figures of merit of a run that was simulated; `system` is the plant that ran, the rest as `merit_observer`'s. Pure: `vmap` it with the loop."""
    return _replayed(merit_observer(system, loop.wanted, band, assumed), loop.run, loop.voltage)


class _Replay(AbstractObserver):
    """An observer of a stored run, whose samples are the inputs of its steps."""

    observer: MeritObserver
    first: _Sample

    def init(self, state: None) -> MeritMemory:
        return self.observer.first(self.first.position, self.first.time)

    def update(self, memory: MeritMemory, step: Step) -> MeritMemory:
        return self.observer.scored(memory, step.inputs)

    def result(self, run: Observed) -> Merit:
        return self.observer.summary(run.memory)


def _replayed(observer: MeritObserver, run: Trajectory, voltage: Series) -> Merit:
    held = jnp.append(jnp.diff(run.time), 0.0)
    samples = _Sample(run.time, run.position, run.temperature, run.martensite_fraction, voltage, held)
    replay = _Replay(observer, jax.tree.map(lambda series: series[0], samples))
    steps = Schedule(jnp.shape(run.time)[0])
    return integrate(lambda carry, _: carry, Carry(None), samples, steps, (replay,)).results[0]


class SetPointMerit(NamedTuple):
    """A set point from when it is set to the next one, and the figures of merit there."""

    begin: float  # s
    end: float  # s
    set_point: float  # rad or m
    merit: Merit  # times count from `begin`


def set_point_spans(set_points: np.ndarray) -> list[tuple[int, int]]:
    """(first sample, last one) of each set point; the last is the next one's first, where its command has done its work."""
    ends = [0, *(np.flatnonzero(np.diff(set_points)) + 1).tolist(), len(set_points) - 1]
    return [(first, last) for first, last in itertools.pairwise(ends) if first < last]


def merit_by_set_point(
    loop: ClosedLoop, system: System, band: Scalar | float | None = None, assumed: System | None = None
) -> tuple[SetPointMerit, ...]:
    """`merit` of each set point by itself, as if the run began where it is set and ended where the next is.

    For runs that have been computed: how many there are is in the values.
    """
    known, replayed = system if assumed is None else assumed, eqx.filter_jit(_replayed)
    held = band_of(known) if band is None else jnp.asarray(band, dtype=float)
    time, wanted = np.asarray(loop.run.time), np.asarray(loop.wanted.position)
    result = []
    for first, last in set_point_spans(wanted):
        run = jax.tree.map(lambda series, part=slice(first, last + 1): series[part], loop.run)
        voltage = jnp.asarray(loop.voltage)[first : last + 1].at[-1].set(loop.voltage[last - 1])
        observer = MeritObserver(system, known.drive, jnp.asarray(wanted[first]), held, last - first + 1)
        one = jax.tree.map(np.asarray, replayed(observer, run, voltage))
        result.append(SetPointMerit(float(time[first]), float(time[last]), float(wanted[first]), one))
    return tuple(result)


def evaluated_loop(setup: ClosedLoopSetup) -> tuple[Merit, Scalar]:
    """(figures of merit, `failed_at`) of a loop, of which nothing else is stored."""
    return observe_closed_loop(merit_observer(setup.system, setup.wanted, assumed=setup.assumed), setup)
