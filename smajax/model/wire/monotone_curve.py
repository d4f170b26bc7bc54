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

from smajax.model.types import Scalar

# Of the cosine's reduced distance: 4, 20, 40, 60, 80 and 96 % of the transformation lie before them.
_BEFORE = (0.12818843369794988, 0.2951672353008665, 0.43590578315102513)
KNOTS = (0.0, *_BEFORE, *(1.0 - one for one in reversed(_BEFORE)), 1.0)
_HELD = 2, 5  # knots that stay where they are


def moved_place(z: Scalar, before: Sequence[Scalar], after: Sequence[Scalar]) -> Scalar:
    """Where the law's shape has what this curve has at the reduced distance `z`, -; exactly `z` with zeros.

    before, after: of the three parts on either side of the middle one, from it outwards: ln of the width over that of the
    part next to it towards the middle, over the same in the cosine, -.
    """
    # The map less z is interpolated, so that it is zero to the bit where nothing is stretched. It is a sum over the parts, each
    # of which stands still outside its own: rounding at a knot then makes no jump, as a choice of one part would.
    cosine = [b - a for a, b in itertools.pairwise(KNOTS)]
    outwards = [*reversed(list(itertools.accumulate(before))), None, *itertools.accumulate(after)]
    relative = [jnp.ones_like(z) if s is None else jnp.exp(s) for s in outwards]
    first, last = _HELD
    between = [w * (r - 1.0) for w, r in zip(cosine[first:last], relative[first:last], strict=True)]
    scale = 1.0 / (1.0 + sum(between[1:], between[0]) / (KNOTS[last] - KNOTS[first]))
    stretch = [r * scale for r in relative]
    width = [w * r for w, r in zip(cosine, stretch, strict=True)]
    wider = [w * (r - 1.0) for w, r in zip(cosine, stretch, strict=True)]
    down = list(itertools.accumulate(reversed(wider[:first]), initial=jnp.zeros_like(z)))
    up = list(itertools.accumulate(wider[first:], initial=jnp.zeros_like(z)))
    less = [*reversed(down), *(-one for one in up[1:])]  # the map less z, at the knots
    knots = [u - d for u, d in zip(KNOTS, less, strict=True)]
    inner = [
        ((2.0 * b + a) * (1.0 - one) + (b + 2.0 * a) * (1.0 - other)) / ((2.0 * b + a) * one + (b + 2.0 * a) * other)
        for (a, b), (one, other) in zip(itertools.pairwise(width), itertools.pairwise(stretch), strict=True)
    ]
    steeper = [1.0 / stretch[0] - 1.0, *inner, 1.0 / stretch[-1] - 1.0]  # its slope less 1
    moved = less[0] + steeper[0] * jnp.minimum(z - knots[0], 0.0) + steeper[-1] * jnp.maximum(z - knots[-1], 0.0)
    for left, wide, (low, high), (rising, falling) in zip(
        knots[:-1], width, itertools.pairwise(less), itertools.pairwise(steeper), strict=True
    ):
        # Hermite's cubic from `left` on, by powers: what is of the coefficients alone is computed once a run, and not in every step.
        chord = (high - low) / wide
        second, third = (3.0 * chord - 2.0 * rising - falling) / wide, (rising + falling - 2.0 * chord) / (wide * wide)
        within = jnp.minimum(jnp.maximum(z - left, 0.0), wide)
        moved = moved + within * (rising + within * (second + within * third))
    return z + moved
