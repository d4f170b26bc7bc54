r"""Cosines of bounded arguments as one polynomial: a batch then runs through a step in vector instructions.

On a CPU the compiler's own cosine is a call a number, and two thirds of a step's time. The polynomial is the Chebyshev
interpolant of $(\cos(\pi\sqrt s/2) - 1)/s$ on $0 \le s \le 1$, degree 7: $\cos(\pi z/2)$ to 2.4e-16 for |z| <= 1 in float64,
exact at z = 0.
"""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp

from smajax.model.types import Scalar

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
# Of $-(\pi/2) \sin(\pi\sqrt s/2)/\sqrt s$, to 4e-16: the slope over z. By its own polynomial it costs half of what
# differentiating the other term by term does.
SLOPE_COEFFICIENTS = (
    -2.4674011002723395,
    1.014678031604156,
    -0.125180884579358,
    0.007354082192633877,
    -0.00025202039981640453,
    5.652998638307676e-06,
    -8.93518912060021e-08,
    1.0130805730119923e-09,
)


def _polynomial(c: tuple[float, ...], s: Scalar) -> Scalar:
    """Of degree 7. In pairs (Estrin's way): the processor need not wait for one multiplication before the next."""
    square = s * s
    fourth = square * square
    low = (c[0] + c[1] * s) + (c[2] + c[3] * s) * square
    high = (c[4] + c[5] * s) + (c[6] + c[7] * s) * square
    return low + high * fourth


@jax.custom_jvp
def quarter_cosine(z: Scalar) -> Scalar:
    """cos(pi z / 2) for |z| <= 1."""
    s = z * z
    return 1.0 + s * _polynomial(COEFFICIENTS, s)


@quarter_cosine.defjvp
def _quarter_cosine_jvp(primals: tuple[Scalar], tangents: tuple[Scalar]) -> tuple[Scalar, Scalar]:
    (z,), (moved,) = primals, tangents
    return quarter_cosine(z), z * _polynomial(SLOPE_COEFFICIENTS, z * z) * moved


def cosine(angle: Scalar) -> Scalar:
    """cos(angle), rad, to 1e-15 times the larger of 1 and |angle|."""
    half_turns = angle * (1.0 / math.pi)
    whole = jnp.round(half_turns)
    odd = whole - 2.0 * jnp.floor(0.5 * whole)
    return (1.0 - 2.0 * odd) * quarter_cosine(2.0 * (half_turns - whole))
