r"""A monotone map of the reduced distance, the identity where nothing is stretched: the place at which a curve is read.

The cosine's range is cut into seven parts at `KNOTS`. Each is $e^s$ times as wide as in the cosine, where $s$ adds up from the
middle part outwards: neighbours differ little, and the ends may reach far. All are then scaled so that a fifth and four fifths
of the transformation stay where the cosine has them. Between knots the map is the monotone cubic of Fritsch and Butland (1984), beyond the
last ones a straight line.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from smajax.model.types import Scalar

# Of the cosine's reduced distance: 4, 20, 40, 60, 80 and 96 % of the transformation lie before them.
_BEFORE = (0.12818843369794988, 0.2951672353008665, 0.43590578315102513)
KNOTS = (0.0, *_BEFORE, *(1.0 - one for one in reversed(_BEFORE)), 1.0)
_HELD = 2, 5  # knots that stay where they are
_COSINE = np.diff(KNOTS)
# Of the coefficients, each side's from the middle outwards: which add up to how much wider each part is than the middle one.
_OUTWARDS = np.zeros((7, 6))
_OUTWARDS[:3, :3], _OUTWARDS[4:, 3:] = np.tri(3)[::-1], np.tri(3)
# Of the parts: which lie between a knot and the first that is held, to its left or its right.
_FURTHER = np.tri(8, 7, -1) - np.tri(8, 7, -1)[_HELD[0]]
_SHARES = _COSINE[_HELD[0] : _HELD[1]] / (KNOTS[_HELD[1]] - KNOTS[_HELD[0]])  # of the parts between those


class MonotoneCurve(eqx.Module):
    """The map with all that is of its coefficients alone: computed once a run, and not wherever a place is looked up."""

    knots: Float[Array, 8]
    width: Float[Array, 7]  # of the parts
    shift: Scalar  # by how much the first knot lies further right
    before: Scalar  # slope of the map less 1 beyond the first knot, and beyond the last
    beyond: Scalar
    rising: Float[Array, 7]  # Hermite's cubic from the left knot on, by powers: the map less z
    square: Float[Array, 7]
    cube: Float[Array, 7]

    def __call__(self, z: Scalar) -> Scalar:
        """The place at the reduced distance `z`, -, both of shape (); `jax.vmap` takes it over arrays."""
        moved: Scalar = _moved((self, z))
        return moved


def _within(curve: MonotoneCurve, z: Scalar) -> Scalar:
    """How far z is within each part, (7,): from 0 to its width."""
    # Not `clip`, whose derivative asks at every end whether it is met exactly.
    within = z - curve.knots[:-1]
    return jnp.where(within < 0.0, 0.0, jnp.where(within > curve.width, curve.width, within))


def _value(curve: MonotoneCurve, within: Scalar, ahead: Scalar, behind: Scalar) -> Scalar:
    """The map less z. A sum over the parts, each of which stands still outside its own: rounding at a knot then makes no jump, as a choice of one part would."""
    inside = jnp.sum(within * (curve.rising + within * (curve.square + within * curve.cube)))
    return inside + curve.before * ahead + curve.beyond * behind - curve.shift


def _outside(curve: MonotoneCurve, z: Scalar) -> tuple[Scalar, Scalar]:
    """How far z is before the first knot (negative) and beyond the last one."""
    ahead, behind = z - curve.knots[0], z - curve.knots[-1]
    return jnp.where(ahead < 0.0, ahead, 0.0), jnp.where(behind > 0.0, behind, 0.0)


@eqx.filter_custom_jvp
def _moved(given: tuple[MonotoneCurve, Scalar]) -> Scalar:
    curve, z = given
    return z + _value(curve, _within(curve, z), *_outside(curve, z))


@_moved.def_jvp
def _moved_jvp(primals, tangents):  # type: ignore[no-untyped-def]  # the signature is equinox's
    r"""With the slope, and what the coefficients change at the same z, as sums over the parts like the map: both are continuous.

    With $t$ within a part: $\phi' = 1 + s_0 + \sum t (2 b + 3 c t)$, and $d\phi = - (d\,shift + s_0\, dk_0) + \sum t (da - 2 b\,dk + t (db - 3 c\,dk + t\,dc))$,
    $k$ the left knot of a part, $a, b, c$ its rising, square and cube, $s_0$ the slope less 1 before the first knot.
    """
    ((curve, z),), ((turned, shifted),) = primals, tangents
    within, outside = _within(curve, z), _outside(curve, z)
    moved = jnp.zeros_like(z)
    if shifted is not None:
        inside = jnp.sum(within * (2.0 * curve.square + 3.0 * within * curve.cube))
        moved = shifted * (1.0 + curve.before + inside)
    if any(leaf is not None for leaf in jax.tree.leaves(turned)):
        moved = moved + _value(_turned(curve, turned), within, *outside)
    return _moved((curve, z)), moved


def _turned(curve: MonotoneCurve, by: MonotoneCurve) -> MonotoneCurve:
    """What a change of the coefficients `by` changes of the map, between the same knots."""
    left = by.knots[:-1]
    return dataclasses.replace(
        curve,
        shift=by.shift + curve.before * by.knots[0],
        before=by.before,
        beyond=by.beyond,
        rising=by.rising - 2.0 * curve.square * left,
        square=by.square - 3.0 * curve.cube * left,
        cube=by.cube,
    )


def monotone_curve(before: Sequence[Scalar], after: Sequence[Scalar]) -> MonotoneCurve:
    """The map with coefficients of shape (), exactly the identity with zeros.

    before, after: of the three parts on either side of the middle one, from it outwards: ln of the width over that of the part
    next to it towards the middle, over the same in the cosine, -.
    """
    # The map less z is interpolated, so that it is zero to the bit where nothing is stretched. Arrays of all parts are an eighth of the operations to trace.
    wider = jnp.expm1(_OUTWARDS @ jnp.stack([*before, *after]))
    between = _SHARES @ wider[_HELD[0] : _HELD[1]]
    scale = 1.0 / (1.0 + between)
    stretch, excess = (1.0 + wider) * scale, (wider - between) * scale  # `excess` is `stretch` less 1
    width = _COSINE * stretch
    further = _FURTHER @ (_COSINE * excess)  # by how much each knot lies further right
    knots = np.asarray(KNOTS) + further
    left, right, one, other = width[:-1], width[1:], stretch[:-1], stretch[1:]
    first, second = 2.0 * right + left, right + 2.0 * left
    inner = -(first * excess[:-1] + second * excess[1:]) / (first * one + second * other)
    # Slope of the map less 1 at the knots, and of the chord of each part.
    slope = jnp.concatenate([-excess[:1] / stretch[:1], inner, -excess[-1:] / stretch[-1:]])
    chord = -excess / stretch
    rising, falling = slope[:-1], slope[1:]
    square, cube = (3.0 * chord - 2.0 * rising - falling) / width, (rising + falling - 2.0 * chord) / (width * width)
    return MonotoneCurve(knots, width, further[0], slope[0], slope[-1], rising, square, cube)
