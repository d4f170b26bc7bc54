"""Smooth functions of one state: cubic B-splines on an even grid, held outside of it, as a sum of cosine waves.

De Boor 1978, chapter X. Evaluated as a cubic with one truncated power at each inner knot: a fraction of the work of the
basis functions, in a place that is evaluated many times a step. The coefficients of the B-splines are a sum of cosine waves, and
the sizes of those are what is fitted: a prior of one width for all of them says that a function is more likely smooth (a discrete
smoothness prior; Wahba 1990, chapter 1), where independent B-splines would each fit the noise of their own few samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.model.types import Scalar

COUNT = 11  # B-splines of one function, and waves
PIECES = COUNT - 3
KNOTS = np.arange(0.0, PIECES)  # in pieces
LONG = 2.0  # half waves over the range, up to which a wave is about as large as the constant; beyond it falls as 1/k^2
# Of a wave of size one: sizes of width one then give functions of standard deviation 0.6 to 0.7, as independent B-splines of width one do.
HEIGHT = 0.5


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


def _waves() -> np.ndarray:
    """(COUNT, COUNT): what each wave of size one contributes to each B-spline's coefficient (a discrete cosine transform)."""
    number = np.arange(COUNT)
    width = HEIGHT / np.sqrt(1.0 + (number / LONG) ** 4)
    return np.cos(np.pi * np.outer(number + 0.5, number) / COUNT) * width


WAVES = _waves()
POWERS = _powers() @ WAVES


def powers_of(coefficients: Sequence[Scalar]) -> Float[Array, 11]:
    """The function's c_0 to c_3 and d_1, d_2, ... of `_powers`, from the sizes of its waves, the constant's first; those of a constant are zero but for that."""
    return jnp.asarray(POWERS) @ jnp.stack(list(coefficients))


class _Place(NamedTuple):
    """A place in the range, by what the function is a sum of there."""

    share: Scalar  # in pieces
    beyond: Float[Array, 8]  # how far beyond each knot, 0 before it


def _place(share: Scalar) -> _Place:
    u = PIECES * jnp.where(share < 0.0, 0.0, jnp.where(share > 1.0, 1.0, share))
    # An array of all knots: a tenth of the operations to trace.
    return _Place(u, jnp.where(u > KNOTS, u - KNOTS, 0.0))


def _sum(powers: Float[Array, 11], at: _Place) -> Scalar:
    cubes: Scalar = jnp.sum(powers[3:] * (at.beyond * at.beyond * at.beyond))
    return powers[0] + at.share * (powers[1] + at.share * powers[2]) + cubes


@jax.jit  # traced once and not at each of the hundred places of a step
def spline(powers: Float[Array, 11], share: Scalar) -> Scalar:
    """The function at `share` of its range, 0..1, of shape (); outside of that what it is at the nearer end."""
    assert jnp.ndim(share) == 0, f"a share of shape {jnp.shape(share)}: `jax.vmap` takes `spline` over an array"
    value: Scalar = _spline((powers, share))
    return value


@eqx.filter_custom_jvp
def _spline(given: tuple[Float[Array, 11], Scalar]) -> Scalar:
    powers, share = given
    return _sum(powers, _place(share))


@_spline.def_jvp
def _spline_jvp(primals, tangents):  # type: ignore[no-untyped-def]  # the signature is equinox's
    ((powers, share),), ((turned, moved),) = primals, tangents
    at, change = _place(share), jnp.zeros_like(share)
    if moved is not None:
        inside = (share >= 0.0) & (share <= 1.0)
        slope = powers[1] + 2.0 * at.share * powers[2] + 3.0 * jnp.sum(powers[3:] * (at.beyond * at.beyond))
        change = jnp.where(inside, PIECES * slope, 0.0) * moved
    if turned is not None:
        change = change + _sum(turned, at)
    return _spline((powers, share)), change


def design(share: np.ndarray) -> np.ndarray:
    """What each coefficient contributes at `share` (n,) of the range: (n, COUNT)."""
    u = PIECES * np.clip(share, 0.0, 1.0)
    columns = [u**power for power in range(3)] + [np.maximum(u - knot, 0.0) ** 3 for knot in KNOTS]
    return np.stack(columns, axis=1) @ POWERS
