r"""Speed at which a set point is approached: in proportion to the way left near it, and with a bounded deceleration further away.

A straight line $\dot x_1 = -k x_1$ asks for a deceleration of $k^2 |x_1|$: more than a wire that only the air cools can give, where the way is long and k
is large enough to settle soon. Proximate time-optimal control (Workman, Kosut, Franklin 1987) goes on with the parabola of a constant deceleration a,

    f(x_1) = k x_1                                          |x_1| <= a/k^2
    f(x_1) = sign(x_1) sqrt(2 a (|x_1| - a/(2 k^2)))        beyond,

of which f and f' are continuous. With a large enough f is the line.
"""

from __future__ import annotations

import jax.numpy as jnp

from smajax.core.parameters import parameter
from smajax.model.types import Scalar

LINE = 1e9  # rad/s^2: nothing brakes like that, and f is the line
SLOWEST = 1e-6  # 1/s: of a k of zero the line has no end either


def braking_parameter() -> Scalar:
    """The field of a controller that has it."""
    return parameter(
        "rad/s^2", 1e-3, LINE, "a: largest deceleration asked for on the way to the set point", default=LINE
    )


def approach_speed(off: Scalar, rate: Scalar | float, braking: Scalar | float) -> Scalar:
    """f of a position that is `off` (rad), rad/s; rate: k, 1/s; braking: a, rad/s^2."""
    way, linear = jnp.abs(off), braking / jnp.where(rate > SLOWEST, rate, SLOWEST) ** 2
    far = way > linear
    root = jnp.sqrt(2.0 * braking * (jnp.where(far, way, linear) - 0.5 * linear))
    return jnp.where(far, jnp.sign(off) * root, rate * off)
