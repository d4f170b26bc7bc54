"""What a control engineer asks of a closed loop, from its trajectory: times, overshoot, error, energy, chatter, heat."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from smajax.closed_loop import ClosedLoop
from smajax.load.base import AbstractMovingLoad
from smajax.system import System
from smajax.types import Scalar, Series
from smajax.wire.resistance import resistance_per_metre

BAND_DEGREES = 1.0  # an angle this near the set point counts as there
BAND_SHARE = 0.01  # a length: this share of the stroke that the recoverable strain gives
STEADY = 0.2  # the last share of a run in which the error counts as steady
LIVELY = 0.5  # V: a command that turns back by less has not switched


class Merit(eqx.Module):
    """Figures of merit of one run to one set point. Times are infinite where the run never gets there."""

    reach_time: Scalar  # s, first within the band or beyond the set point
    settling_time: Scalar  # s, in the band from there on, the whole last fifth of the run at least
    overshoot: (
        Scalar  # rad or m, largest distance beyond the set point, seen from the start (any, where it starts there)
    )
    steady_error: Scalar  # rad or m, mean of the absolute error over the last fifth
    steady_offset: Scalar  # rad or m, mean of position - set point there
    energy: Scalar  # J into the wire
    switches_per_second: Scalar  # 1/s, how often the command turns back by more than half a volt
    peak_temperature: Scalar  # C


def band_of(system: System) -> Scalar:
    """One degree for an angle, one per cent of the stroke for a length; rad or m."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    if load.reading[1] == "rad":
        return jnp.radians(jnp.asarray(BAND_DEGREES))
    return BAND_SHARE * system.wire.constitutive.recoverable_strain / load.contraction(system.wire)


def switches(command: Series) -> Scalar:
    """How often a command turns back by more than `LIVELY` from its last extreme."""

    def follow(carry: tuple[Scalar, Scalar], now: Scalar) -> tuple[tuple[Scalar, Scalar], Scalar]:
        extreme, rising = carry  # the highest (lowest) value since the last turn; 1 up, -1 down
        further = jnp.where(rising * (now - extreme) > 0.0, now, extreme)
        turned = rising * (further - now) > LIVELY
        return (jnp.where(turned, now, further), jnp.where(turned, -rising, rising)), turned

    _, turns = lax.scan(follow, (command[0], jnp.ones_like(command[0])), command)
    return turns.sum()


def merit(loop: ClosedLoop, system: System, band: Scalar | float | None = None) -> Merit:
    """Judge a run against its last set point; `system` is the plant that ran. Pure: `vmap` it with the loop.

    `band`, rad or m, is how near counts as there; default `band_of` the system.
    """
    band = band_of(system) if band is None else band
    run, target = loop.run, loop.wanted.position[-1]
    error = run.position - target
    side = jnp.where(error[0] < 0.0, 1.0, -1.0)
    there = side * error >= -band
    beyond = jnp.where(jnp.abs(error[0]) <= band, jnp.abs(error), side * error)
    outside = jnp.abs(error) > band
    last_outside = jnp.max(jnp.where(outside, jnp.arange(outside.size), -1))
    after = jnp.minimum(last_outside + 1, outside.size - 1)
    steady = run.time >= run.time[-1] - STEADY * (run.time[-1] - run.time[0])
    # A run that is inside at its last sample by chance has not settled.
    unsettled = (outside & steady).any()
    settling = jnp.where(unsettled, jnp.inf, jnp.where(last_outside < 0, 0.0, run.time[after]))
    weight = steady / steady.sum()
    return Merit(
        reach_time=jnp.where(there.any(), run.time[jnp.argmax(there)], jnp.inf),
        settling_time=settling,
        overshoot=jnp.maximum(jnp.max(beyond), 0.0),
        steady_error=(weight * jnp.abs(error)).sum(),
        steady_offset=(weight * error).sum(),
        energy=(power(loop, system)[:-1] * jnp.diff(run.time)).sum(),
        switches_per_second=switches(loop.voltage) / (run.time[-1] - run.time[0]),
        peak_temperature=run.temperature.max(),
    )


def power(loop: ClosedLoop, system: System) -> Series:
    """Electrical power into the wire, W."""

    def at(temperature: Scalar, fraction: Scalar, voltage: Scalar) -> Scalar:
        ohms = resistance_per_metre(system.wire, system.effects, temperature, fraction)
        return system.drive.power(ohms, system.wire.wire_length, system.drive.from_voltage(voltage))

    return jax.vmap(at)(loop.run.temperature, loop.run.martensite_fraction, loop.voltage) * system.wire.wire_length
