"""What a control engineer asks of a closed loop, from its trajectory: times, overshoot, error, energy, chatter, heat."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from smajax.closed_loop import ClosedLoop
from smajax.system import System
from smajax.types import Scalar, Series
from smajax.wire.resistance import resistance_per_metre

BAND = 0.0174532925199433  # rad: one degree about the set point counts as there
STEADY = 0.2  # the last share of a run in which the error counts as steady
LIVELY = 0.5  # V: a command that varies by less does not switch


class Merit(eqx.Module):
    """Figures of merit of one run to one set point. Times are infinite where the run never gets there."""

    reach_time: Scalar  # s, first within the band or beyond the set point
    settling_time: Scalar  # s, in the band from there on
    overshoot: Scalar  # rad or m, largest distance beyond the set point, seen from the start
    steady_error: Scalar  # rad or m, mean of the absolute error over the last fifth
    steady_offset: Scalar  # rad or m, mean of position - set point there
    energy: Scalar  # J into the wire
    switches_per_second: Scalar  # 1/s, how often the command crosses the middle of its own range
    peak_temperature: Scalar  # C


def merit(loop: ClosedLoop, system: System, band: Scalar | float = BAND) -> Merit:
    """Judge a run against its last set point; `system` is the plant that ran. Pure: `vmap` it with the loop."""
    run, target = loop.run, loop.wanted.position[-1]
    error = run.position - target
    side = jnp.where(run.position[0] < target, 1.0, -1.0)
    there = side * error >= -band
    outside = jnp.abs(error) > band
    last_outside = jnp.max(jnp.where(outside, jnp.arange(outside.size), -1))
    after = jnp.minimum(last_outside + 1, outside.size - 1)
    settling = jnp.where(outside[-1], jnp.inf, jnp.where(last_outside < 0, 0.0, run.time[after]))
    steady = run.time >= run.time[-1] - STEADY * (run.time[-1] - run.time[0])
    weight = steady / steady.sum()
    high, low = loop.voltage.max(), loop.voltage.min()
    up = loop.voltage > 0.5 * (high + low)
    switches = jnp.where(high - low > LIVELY, (up[1:] != up[:-1]).sum(), 0)
    return Merit(
        reach_time=jnp.where(there.any(), run.time[jnp.argmax(there)], jnp.inf),
        settling_time=settling,
        overshoot=jnp.maximum(jnp.max(side * error), 0.0),
        steady_error=(weight * jnp.abs(error)).sum(),
        steady_offset=(weight * error).sum(),
        energy=(power(loop, system)[:-1] * jnp.diff(run.time)).sum(),
        switches_per_second=switches / (run.time[-1] - run.time[0]),
        peak_temperature=run.temperature.max(),
    )


def power(loop: ClosedLoop, system: System) -> Series:
    """Electrical power into the wire, W."""

    def at(temperature: Scalar, fraction: Scalar, voltage: Scalar) -> Scalar:
        ohms = resistance_per_metre(system.wire, system.effects, temperature, fraction)
        return system.drive.power(ohms, system.wire.wire_length, system.drive.from_voltage(voltage))

    return jax.vmap(at)(loop.run.temperature, loop.run.martensite_fraction, loop.voltage) * system.wire.wire_length
