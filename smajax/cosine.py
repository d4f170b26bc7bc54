r"""Cosines of bounded arguments as one polynomial: a batch then runs through a step in vector instructions.

On a CPU the compiler's own cosine is a call a number, and two thirds of a step's time. The polynomial is the Chebyshev
interpolant of $(\cos(\pi\sqrt s/2) - 1)/s$ on $0 \le s \le 1$, degree 7: $\cos(\pi z/2)$ to 2.4e-16 for |z| <= 1 in float64,
exact at z = 0.
"""

from __future__ import annotations

import math

import jax.numpy as jnp

from smajax.types import Scalar

COEFFICIENTS = (
    -1.2337005501361697,
    0.253669507901046,
    -0.02086348076331063,
    0.0009192602745006437,
    -2.5202041041025108e-05,
    4.710846321668482e-07,
    -6.3832315751919636e-09,
    6.357424822347121e-11,
)


def quarter_cosine(z: Scalar) -> Scalar:
    """cos(pi z / 2) for |z| <= 1."""
    s = z * z
    total = jnp.full_like(s, COEFFICIENTS[-1])
    for coefficient in reversed(COEFFICIENTS[:-1]):
        total = total * s + coefficient
    return 1.0 + s * total


def cosine(angle: Scalar) -> Scalar:
    """cos(angle), rad, to 1e-15 times the larger of 1 and |angle|."""
    half_turns = angle * (1.0 / math.pi)
    whole = jnp.round(half_turns)
    odd = whole - 2.0 * jnp.floor(0.5 * whole)
    return (1.0 - 2.0 * odd) * quarter_cosine(2.0 * (half_turns - whole))
