"""The root of a rising function of one unknown, found for certain and differentiable."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from smajax.types import Scalar

MOST_ITERATIONS = 80
ROUNDINGS = 4.0


class Bracket(NamedTuple):
    """An iterate between the ends that the root is known to lie between, and the last change."""

    here: Scalar
    low: Scalar
    high: Scalar
    change: Scalar
    steps: Scalar


def root(
    miss: Callable[[Scalar], Scalar], start: Scalar, low: Scalar, high: Scalar, scale: Scalar | float = 1.0
) -> Scalar:
    """Where `miss` is zero between `low` and `high`; `miss` rises and its root lies there. `scale` is that of the root.

    Newton's steps, or halvings of the bracket where those lead out of it or would not shrink it. The iteration itself
    is not differentiated: `lax.custom_root` gives the root its derivatives, of any order.
    """
    tolerance = ROUNDINGS * jnp.finfo(jnp.result_type(start)).eps * jnp.asarray(scale)

    def at(here: Scalar) -> tuple[Scalar, Scalar]:
        value, slope = jax.value_and_grad(miss)(here)
        return lax.stop_gradient(value), lax.stop_gradient(slope)

    def body(now: Bracket) -> Bracket:
        value, slope = at(now.here)
        low, high = jnp.where(value < 0.0, now.here, now.low), jnp.where(value > 0.0, now.here, now.high)
        free = now.here - value / slope
        # Every third step halves: a function that is steep, flat and steep again can send Newton to and fro.
        inside = (free > low) & (free < high) & (now.steps % 3 != 2)
        there = jnp.where(value == 0.0, now.here, jnp.where(inside, free, 0.5 * (low + high)))
        return Bracket(there, low, high, jnp.abs(there - now.here), now.steps + 1)

    def unfinished(now: Bracket) -> Scalar:
        return (now.change > tolerance) & (now.steps < MOST_ITERATIONS)

    held = lax.stop_gradient
    first = Bracket(held(start), held(low), held(high), jnp.full_like(start, jnp.inf), jnp.zeros_like(start, int))
    found = held(lax.while_loop(unfinished, body, first).here)
    slope = at(found)[1]
    exact = lax.custom_root(miss, found, lambda f, here: here - f(here) / slope, lambda g, asked: asked / g(1.0))
    return jnp.where(exact > high, high, jnp.where(exact < low, low, exact))
