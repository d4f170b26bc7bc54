r"""Integral action of the backstepping controllers, which the source's design has not: it holds a wrong plant on its set point.

Both steps of the design get an integral beside what is made to die out. With $x_1 = \theta - \theta_d$, $x_2 = \dot x_1$ and the pull
$w = K_0 x_1 + K x_2$, the stress is asked for that gives

    x_1'' + w + w_0/T_i = 0,      w_0' = w                     eq. 4.57 and 4.70: K_0 = 1/s^2, no w_0

By Routh that is stable exactly for $K T_i + K^2/K_0 > 1$, and then the Lyapunov equation $A^T P + P A = -Q$ of the chain $(w_0, x_1, x_2)$
has a positive P for every positive Q: $x^T P x$ takes the place of $(x_1^2 + x_2^2)/2$ in eq. 4.58. The integral is of w and not of $x_1$: along the motion that is
asked for w is no more than the acceleration, so that a long way to the set point does not fill it. The inner step likewise,

    z' = -k (z + z_0/T_z),      z_0' = z                       eq. 4.65 and 4.79: no z_0

stable for all positive k and $T_z$, with $V = z^2/2 + k (z_0 - d T_z/k)^2/(2 T_z)$, $\dot V = -k z^2$ for any constant d that is added to z': what the heat
balance has wrong, such as the convection, ends in $z_0$. What the load has wrong ends in $w_0$.
"""

from __future__ import annotations

import jax.numpy as jnp

from smajax.model.types import Scalar


def next_integral(integral: Scalar, error: Scalar, period: Scalar, voltage: Scalar, largest: Scalar) -> Scalar:
    """The integral of `error` after a period. It waits while the command is at the limit that the error pushes it to.

    error: positive where the command is to fall, as w, z and z_1 are.
    """
    short = (voltage >= largest) & (error < 0.0)
    beyond = (voltage <= 0.0) & (error > 0.0)
    return integral + jnp.where(short | beyond, 0.0, period) * error
