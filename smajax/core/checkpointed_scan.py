"""A scan whose reverse-mode derivative stores the square root of its steps, not all of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jax.ad_checkpoint import checkpoint_name

from smajax.core.where_tree import where_tree

# A segment may be this many times longer or shorter than the best one, to divide the steps evenly.
UNEVEN = 2.0
SOLVED = "solved"


def solved(tree: Any) -> Any:
    """`tree`, the outcome of an iteration that `recomputed` is not to do again."""
    return jax.tree.map(lambda one: checkpoint_name(one, SOLVED), tree)


def recomputed(body: Callable[..., Any]) -> Callable[..., Any]:
    """`body`, of which a reverse-mode derivative stores what it began with and what was `solved` in it, and nothing else.

    To compute the rest again is quicker than to store and fetch it.
    """
    return jax.checkpoint(body, prevent_cse=False, policy=jax.checkpoint_policies.save_only_these_names(SOLVED))


def segment_of(length: int, weight: int = 1) -> int:
    """Steps a segment, a divisor of `length` where there is a suitable one. A step stands for `weight` inner ones."""
    best = max(1.0, math.sqrt(length / weight))
    near = range(math.ceil(best / UNEVEN), math.floor(best * UNEVEN) + 1)
    return min((size for size in near if length % size == 0), key=lambda size: abs(size - best), default=round(best))


def checkpointed_scan(
    body: Callable[[Any, Any], tuple[Any, Any]], carry: Any, xs: Any, length: int, weight: int = 1
) -> tuple[Any, Any]:
    """`lax.scan`. Its reverse-mode derivative stores the carry at the start of each of about `sqrt(length)` segments,
    and computes the carries within a segment again when it comes to it: one run more, for memory that grows as the
    square root. Without a derivative, and in forward mode, it costs what `lax.scan` does.

    A length that has no suitable divisor is filled up with steps that change nothing: choose a round number.
    """
    size = segment_of(length, weight)
    segments = -(-length // size)
    spare = segments * size - length

    def alive(carry: Any, now: tuple[Any, Any]) -> tuple[Any, Any]:
        own, live = now
        new, out = body(carry, own)
        return where_tree(live, new, carry), out

    step, inputs = (alive, (xs, jnp.arange(length + spare) < length)) if spare else (body, xs)

    def segment(carry: Any, now: Any) -> tuple[Any, Any]:
        return lax.scan(step, carry, now, length=size)

    def split(leaf: jax.Array) -> jax.Array:
        lacking = length + spare - leaf.shape[0]
        whole = jnp.concatenate([leaf, jnp.repeat(leaf[-1:], lacking, axis=0)]) if lacking else leaf
        return whole.reshape(segments, size, *leaf.shape[1:])

    carry, out = lax.scan(jax.checkpoint(segment, prevent_cse=False), carry, jax.tree.map(split, inputs), segments)
    return carry, jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:])[:length], out)
