"""Smooth functions of one state: cubic B-splines on an even grid, held outside of it.

De Boor 1978, chapter X. Evaluated as a cubic with one truncated power at each inner knot: a fraction of the work of the
basis functions, in a place that is evaluated many times a step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from smajax.model.types import Scalar

COUNT = 7  # coefficients of one function
PIECES = COUNT - 3


def _powers() -> np.ndarray:
    """(4 + PIECES - 1, COUNT): cubic B-spline j as c_0 + c_1 u + c_2 u^2 + c_3 u^3 + sum_k d_k (u - k)_+^3 on 0..PIECES."""
    table = np.zeros((3 + PIECES, COUNT))
    for basis in range(COUNT):
        for number in range(5):
            knot = basis - 3 + number
            weight = (-1) ** number * math.comb(4, number) / 6.0
            if knot <= 0:
                for power in range(4):
                    table[power, basis] += weight * math.comb(3, power) * float(-knot) ** (3 - power)
            elif knot < PIECES:
                table[3 + knot, basis] += weight
    return table


POWERS = _powers()


@jax.jit  # traced once and not at each of the hundred places of a step
def spline(coefficients: Sequence[Scalar], share: Scalar) -> Scalar:
    """The function at `share` of its range, 0..1; outside of that what it is at the nearer end.

    `coefficients` are about its values at the knots and, the first and the last, a piece beyond the range; those of a
    constant are all alike.
    """
    u = PIECES * jnp.where(share < 0.0, 0.0, jnp.where(share > 1.0, 1.0, share))
    powers = [
        sum(float(weight) * one for weight, one in zip(row, coefficients, strict=True) if weight) for row in POWERS
    ]
    found = powers[0] + u * (powers[1] + u * (powers[2] + u * powers[3]))
    for knot in range(1, PIECES):
        beyond = jnp.where(u > knot, u - knot, 0.0)
        found = found + powers[3 + knot] * beyond * beyond * beyond
    return found


def design(share: np.ndarray) -> np.ndarray:
    """What each coefficient contributes at `share` (n,) of the range: (n, COUNT)."""
    u = PIECES * np.clip(share, 0.0, 1.0)
    columns = [u**power for power in range(4)] + [np.maximum(u - knot, 0.0) ** 3 for knot in range(1, PIECES)]
    return np.stack(columns, axis=1) @ POWERS
