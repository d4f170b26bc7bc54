r"""A monotone map of the reduced distance, the identity where nothing is stretched: the place at which a curve is read.

The cosine's range is cut into seven parts at `KNOTS`. Each is $e^s$ times as wide as in the cosine, where $s$ adds up from the
middle part outwards: neighbours differ little, and the ends may reach far. All are then scaled so that a fifth and four fifths
of the transformation stay where the cosine has them. Between knots the map is the monotone cubic of Fritsch and Butland (1984), beyond the
last ones a straight line.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from smajax.model.types import Scalar

# Of the cosine's reduced distance: 4, 20, 40, 60, 80 and 96 % of the transformation lie before them.
_BEFORE = (0.12818843369794988, 0.2951672353008665, 0.43590578315102513)
KNOTS = (0.0, *_BEFORE, *(1.0 - one for one in reversed(_BEFORE)), 1.0)
_HELD = 2, 5  # knots that stay where they are
_COSINE = np.diff(KNOTS)
_SHARES = _COSINE[_HELD[0] : _HELD[1]] / (KNOTS[_HELD[1]] - KNOTS[_HELD[0]])  # of the parts between those


def moved_place(z: Scalar, before: Sequence[Scalar], after: Sequence[Scalar]) -> Scalar:
    """Where the law's shape has what this curve has at the reduced distance `z`, -; exactly `z` with zeros.

    z: shape (), as all coefficients; `jax.vmap` takes it over arrays. before, after: of the three parts on either side of the middle
    one, from it outwards: ln of the width over that of the part next to it towards the middle, over the same in the cosine, -.
    """
    # The map less z is interpolated, so that it is zero to the bit where nothing is stretched. It is a sum over the parts, each
    # of which stands still outside its own: rounding at a knot then makes no jump, as a choice of one part would. Arrays of all parts
    # are an eighth of the operations to trace.
    outwards = [*reversed(list(itertools.accumulate(before))), jnp.zeros_like(z), *itertools.accumulate(after)]
    wider = jnp.expm1(jnp.stack(outwards))
    between = _SHARES @ wider[_HELD[0] : _HELD[1]]
    scale = 1.0 / (1.0 + between)
    stretch, excess = (1.0 + wider) * scale, (wider - between) * scale  # `excess` is `stretch` less 1
    width = _COSINE * stretch
    parts = list(_COSINE * excess)
    further = [jnp.zeros_like(z)]  # by how much each knot lies further right
    for one in parts[_HELD[0] :]:
        further.append(further[-1] + one)
    for one in reversed(parts[: _HELD[0]]):
        further.insert(0, further[0] - one)
    knots = np.asarray(KNOTS) + jnp.stack(further)
    left, right, one, other = width[:-1], width[1:], stretch[:-1], stretch[1:]
    first, second = 2.0 * right + left, right + 2.0 * left
    inner = -(first * excess[:-1] + second * excess[1:]) / (first * one + second * other)
    # Slope of the map less 1 at the knots, and of the chord of each part.
    slope = jnp.concatenate([-excess[:1] / stretch[:1], inner, -excess[-1:] / stretch[-1:]])
    chord = -excess / stretch
    rising, falling = slope[:-1], slope[1:]
    # Hermite's cubic from the left knot on, by powers: what is of the coefficients alone is computed once a run, and not in every step.
    square, cube = (3.0 * chord - 2.0 * rising - falling) / width, (rising + falling - 2.0 * chord) / (width * width)
    within = jnp.clip(z - knots[:-1], 0.0, width)
    inside = jnp.sum(within * (rising + within * (square + within * cube)))
    beyond = slope[0] * jnp.minimum(z - knots[0], 0.0) + slope[-1] * jnp.maximum(z - knots[-1], 0.0)
    return z - further[0] + inside + beyond
