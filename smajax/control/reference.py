"""What the position should be: a constant, steps, a ramp, a sine, or samples from elsewhere. rad or m."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp

from smajax.model.types import Scalar, Series


class Reference(eqx.Module):
    """Position wanted and its derivatives, arrays of shape (n,) or, within a control period, scalars."""

    position: Series
    velocity: Series
    acceleration: Series


def clock(seconds: float, dt: float) -> Series:
    """t_0 ... t_n, s. Raises ValueError for a step that is none."""
    if not 0.0 < dt < float("inf") or not 0.0 <= seconds < float("inf"):
        raise ValueError(f"a clock takes seconds of 0 or more and a `dt` above zero, not {seconds:g} and {dt:g}.")
    return dt * jnp.arange(round(seconds / dt) + 1)


def resting(position: Series) -> Reference:
    """Set points: the position as given, derivatives zero, also where it jumps."""
    position = jnp.asarray(position, dtype=float)
    return Reference(position, jnp.zeros_like(position), jnp.zeros_like(position))


def constant(time: Series, position: Scalar | float) -> Reference:
    """One set point."""
    return resting(jnp.full_like(time, position))


def steps(time: Series, positions: Sequence[float], hold: float) -> Reference:
    """Set points one after the other, each held for `hold` seconds, the last one to the end."""
    # A sample that rounding put a hair before the switch belongs after it.
    which = jnp.clip(jnp.floor(time / hold + 1e-9).astype(int), 0, len(positions) - 1)
    return resting(jnp.asarray(positions, dtype=float)[which])


def ramp(time: Series, start: Scalar | float, end: Scalar | float, seconds: float) -> Reference:
    """From `start` to `end` at constant speed in `seconds`, then at rest."""
    share = jnp.clip(time / seconds, 0.0, 1.0)
    speed = jnp.where(time < seconds, (end - start) / seconds, 0.0)
    return Reference(start + (end - start) * share, speed, jnp.zeros_like(time))


def sine(time: Series, middle: Scalar | float, amplitude: Scalar | float, frequency: Scalar | float) -> Reference:
    """`middle + amplitude sin(2 pi f t)`."""
    rate = 2.0 * jnp.pi * frequency
    wave = amplitude * jnp.sin(rate * time)
    return Reference(middle + wave, amplitude * rate * jnp.cos(rate * time), -(rate**2) * wave)


def sampled(position: Series, dt: float) -> Reference:
    """A measured or computed path, `dt` seconds apart: derivatives by central differences."""
    position = jnp.asarray(position, dtype=float)
    velocity = jnp.asarray(jnp.gradient(position, dt))
    return Reference(position, velocity, jnp.asarray(jnp.gradient(velocity, dt)))
