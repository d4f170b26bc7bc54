"""The root of a rising function of one unknown, found for certain and differentiable."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from smajax.model.types import Scalar

MOST_ITERATIONS = 80
UNDAMPED = 6  # iterations before every third one halves
ROUNDINGS = 4.0


class Bracket(NamedTuple):
    """An iterate between the ends that the root is known to lie between, and the last change."""

    here: Scalar
    low: Scalar
    high: Scalar
    change: Scalar
    steps: Scalar


def bracketed(
    miss: Callable[[Scalar], Scalar], start: Scalar, low: Scalar, high: Scalar, tolerance: Scalar | float
) -> Scalar:
    """Where `miss`, which rises, is zero between `low` and `high`, to a last step of `tolerance`. Not to be differentiated.

    Newton's steps, or halvings of the bracket where those lead out of it or would not shrink it.
    """

    def body(now: Bracket) -> Bracket:
        value, slope = lax.stop_gradient(jax.jvp(miss, (now.here,), (jnp.ones_like(now.here),)))
        low, high = jnp.where(value < 0.0, now.here, now.low), jnp.where(value > 0.0, now.here, now.high)
        free = now.here - value / slope
        # Later every third step halves: a function that is steep, flat and steep again can send Newton to and fro.
        inside = (free > low) & (free < high) & ((now.steps < UNDAMPED) | (now.steps % 3 != 2))
        there = jnp.where(value == 0.0, now.here, jnp.where(inside, free, 0.5 * (low + high)))
        return Bracket(there, low, high, jnp.abs(there - now.here), now.steps + 1)

    def unfinished(now: Bracket) -> Scalar:
        return (now.change > tolerance) & (now.steps < MOST_ITERATIONS)

    first = Bracket(start, low, high, jnp.full_like(start, jnp.inf), jnp.zeros_like(start, int))
    return lax.while_loop(unfinished, body, first).here


def root(
    miss: Callable[[Scalar], Scalar], start: Scalar, low: Scalar, high: Scalar, scale: Scalar | float = 1.0
) -> Scalar:
    """`bracketed` to rounding, and differentiable: `miss` rises, its root lies between the ends, `scale` is its size.

    The iteration itself is not differentiated: `lax.custom_root` gives the root its derivatives: of any order
    in forward mode, of the first two where reverse mode is among them.
    """
    tolerance = ROUNDINGS * jnp.finfo(jnp.result_type(start)).eps * jnp.asarray(scale)
    held = lax.stop_gradient
    rough = held(bracketed(miss, held(start), held(low), held(high), tolerance))
    slope = held(jax.grad(miss)(rough))
    exact = lax.custom_root(miss, rough, lambda f, here: here - f(here) / slope, lambda g, right: right / g(1.0))
    return jnp.where(exact > high, high, jnp.where(exact < low, low, exact))
