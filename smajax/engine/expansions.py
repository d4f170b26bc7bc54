"""Operations that are written in others: random numbers (Threefry, Salmon et al. 2011), the inverse error function, and small triangles.

Each is a function of plain arrays, of which JAX makes the program that the translator takes in the operation's place. A random
key is its two 32-bit words throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax
from jax.extend.random import threefry_prng_impl as threefry

from smajax.engine.text import Unsupported
from smajax.engine.values import SMALL

ROTATIONS = ((13, 15, 26, 6), (17, 29, 16, 24))
PARITY = 0x1BD11BDA
# Of erf^-1(x)/x: Chebyshev fits of Giles (2010), the highest power first, below and above a bound of w = -log(1 - x^2); the
# second and third are in the square root of w.
DOUBLE: tuple[tuple[float, float, tuple[float, ...]], ...] = (
    (
        6.25,
        3.125,
        (
            -3.6444120640178196996e-21,
            -1.685059138182016589e-19,
            1.2858480715256400167e-18,
            1.115787767802518096e-17,
            -1.333171662854620906e-16,
            2.0972767875968561637e-17,
            6.6376381343583238325e-15,
            -4.0545662729752068639e-14,
            -8.1519341976054721522e-14,
            2.6335093153082322977e-12,
            -1.2975133253453532498e-11,
            -5.4154120542946279317e-11,
            1.051212273321532285e-09,
            -4.1126339803469836976e-09,
            -2.9070369957882005086e-08,
            4.2347877827932403518e-07,
            -1.3654692000834678645e-06,
            -1.3882523362786468719e-05,
            0.0001867342080340571352,
            -0.00074070253416626697512,
            -0.0060336708714301490533,
            0.24015818242558961693,
            1.6536545626831027356,
        ),
    ),
    (
        16.0,
        3.25,
        (
            2.2137376921775787049e-09,
            9.0756561938885390979e-08,
            -2.7517406297064545428e-07,
            1.8239629214389227755e-08,
            1.5027403968909827627e-06,
            -4.013867526981545969e-06,
            2.9234449089955446044e-06,
            1.2475304481671778723e-05,
            -4.7318229009055733981e-05,
            6.8284851459573175448e-05,
            2.4031110387097893999e-05,
            -0.0003550375203628474796,
            0.00095328937973738049703,
            -0.0016882755560235047313,
            0.0024914420961078508066,
            -0.0037512085075692412107,
            0.005370914553590063617,
            1.0052589676941592334,
            3.0838856104922207635,
        ),
    ),
    (
        float("inf"),
        5.0,
        (
            -2.7109920616438573243e-11,
            -2.5556418169965252055e-10,
            1.5076572693500548083e-09,
            -3.7894654401267369937e-09,
            7.6157012080783393804e-09,
            -1.4960026627149240478e-08,
            2.9147953450901080826e-08,
            -6.7711997758452339498e-08,
            2.2900482228026654717e-07,
            -9.9298272942317002539e-07,
            4.5260625972231537039e-06,
            -1.9681778105531670567e-05,
            7.5995277030017761139e-05,
            -0.00021503011930044477347,
            -0.00013871931833623122026,
            1.0103004648645343977,
            4.8499064014085844221,
        ),
    ),
)
SINGLE: tuple[tuple[float, float, tuple[float, ...]], ...] = (
    (
        5.0,
        2.5,
        (
            2.81022636e-08,
            3.43273939e-07,
            -3.5233877e-06,
            -4.39150654e-06,
            0.00021858087,
            -0.00125372503,
            -0.00417768164,
            0.246640727,
            1.50140941,
        ),
    ),
    (
        float("inf"),
        3.0,
        (
            -0.000200214257,
            0.000100950558,
            0.00134934322,
            -0.00367342844,
            0.00573950773,
            -0.0076224613,
            0.00943887047,
            1.00167406,
            2.83297682,
        ),
    ),
)


def _one_by_one(function: Callable[..., Any], *arrays: jax.Array) -> Any:
    """An elementwise function; of large arrays number after number, so that what is between them needs no memory."""
    shape = jnp.broadcast_shapes(*(one.shape for one in arrays))
    whole = [jnp.broadcast_to(one, shape) for one in arrays]
    if whole[0].size <= SMALL:
        return function(*whole)
    result = lax.map(lambda each: function(*each), tuple(one.ravel() for one in whole))
    return jax.tree.map(lambda one: one.reshape(shape), result)


def _block(first: jax.Array, second: jax.Array, left: jax.Array, right: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Threefry-2x32 of 20 rounds: a pair of counters under a key of two words."""
    keys = (first, second, first ^ second ^ jnp.uint32(PARITY))
    left, right = left + keys[0], right + keys[1]
    for number in range(5):
        for by in ROTATIONS[number % 2]:
            left = left + right
            right = left ^ ((right << jnp.uint32(by)) | (right >> jnp.uint32(32 - by)))
        left = left + keys[(number + 1) % 3]
        right = right + keys[(number + 2) % 3] + jnp.uint32(number + 1)
    return left, right


def _inverse_error(x: jax.Array) -> jax.Array:
    w = -jnp.log1p(-x * x)
    parts = DOUBLE if x.dtype == jnp.float64 else SINGLE
    result = None
    for number, (bound, middle, coefficients) in reversed(list(enumerate(parts))):
        z = (w if number == 0 else jnp.sqrt(w)) - middle
        value = jnp.full_like(x, coefficients[0])
        for coefficient in coefficients[1:]:
            value = value * z + coefficient
        result = value if result is None else jnp.where(w < bound, value, result)
    assert result is not None
    return jnp.where(jnp.abs(x) == 1.0, x * jnp.inf, result * x)


# Operation -> (its parameters) -> the function of plain arrays that it is.
def small_cholesky(matrix: jax.Array) -> jax.Array:
    """The lower triangle whose square is a small matrix (n, n); NaN of one that is not positive, as JAX has it. Raises Unsupported for a batch."""
    if matrix.ndim != 2:
        raise Unsupported("the operation `cholesky` of a batch")
    size = matrix.shape[0]
    rows: list[list[Any]] = [[jnp.zeros((), matrix.dtype)] * size for _ in range(size)]
    for j in range(size):
        for i in range(j, size):
            left = matrix[i, j] - sum((rows[i][k] * rows[j][k] for k in range(j)), jnp.zeros((), matrix.dtype))
            rows[i][j] = jnp.sqrt(left) if i == j else left / rows[j][j]
    return jnp.stack([jnp.stack(row) for row in rows])


EXPANSIONS: dict[str, Callable[[Any], Callable[..., Any]]] = {
    "threefry2x32": lambda params: lambda *words: _one_by_one(_block, *words),
    "cholesky": lambda params: small_cholesky,
    "erf_inv": lambda params: lambda x: _one_by_one(_inverse_error, x),
    "random_bits": lambda params: lambda key: threefry.random_bits(key, params["bit_width"], tuple(params["shape"])),
    "random_fold_in": lambda params: lambda key, number: threefry.fold_in(key, number),
    "random_split": lambda params: lambda key: threefry.split(key, tuple(params["shape"])),
}
