"""What effects remember of a wire from step to step: entries of `WireState.kept`, there only if an effect asks for them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp

from smajax.model.types import Scalar, WireState

if TYPE_CHECKING:
    from smajax.model.effects.base import AbstractEffect

DURATION = "duration"  # s, of the step that is being made
TRANSFORMED = "transformed"  # -, sum of all |d xi| so far; 2 a full cycle


def kept_after(
    effects: Sequence[AbstractEffect], old: WireState, temperature: Scalar, stress: Scalar, fraction: Scalar
) -> dict[str, Scalar]:
    """The memory after a step from `old`, known before the step is solved: stress and strain belong to it exactly."""
    kept = dict(old.kept)
    for effect in effects:
        kept.update(effect.kept_after(old, temperature, stress, fraction))
    return kept


def over(old: WireState, duration: Scalar | float) -> WireState:
    """`old` as the beginning of a step of `duration` seconds; 0: as it is."""
    if DURATION not in old.kept:
        return old
    return dataclasses.replace(old, kept={**old.kept, DURATION: duration + jnp.zeros_like(old.stress)})


def transformed(old: WireState, fraction: Scalar) -> dict[str, Scalar]:
    """The entry `TRANSFORMED` after a step."""
    return {TRANSFORMED: old.kept[TRANSFORMED] + jnp.abs(fraction - old.martensite_fraction)}


def forgotten(steps: Scalar) -> Scalar:
    """1 - exp(-steps), without the cancellation that leaves single precision nothing of a small one."""
    small = steps < 1e-3
    short = jnp.where(small, steps, 0.0)
    return jnp.where(small, short * (1.0 - 0.5 * short * (1.0 - short / 3.0)), 1.0 - jnp.exp(-steps))


def following(old: WireState, name: str, before: Scalar, now: Scalar, time_constant: Scalar) -> Scalar:
    r"""The entry `name` after a step in which what it follows went from `before` to `now`, time constant $\tau$ in s.

    Exact for a straight line between the two, $x + (x_{old} - x_{before}) e^{-h/\tau} - (x - x_{before})(1 - e^{-h/\tau})\tau/h$:
    a lag of a few steps, or of less than one, is as good as a long one. `now` itself at 0 s.
    """
    # A time constant of a femtosecond is none, and has a derivative that zero has not.
    steps = jnp.maximum(old.kept[DURATION], 1e-12) / (time_constant + 1e-15)
    gone = forgotten(steps)
    return now + (old.kept[name] - before) * (1.0 - gone) - (now - before) * gone / steps
