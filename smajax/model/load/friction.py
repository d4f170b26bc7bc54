r"""Friction of a load's guide: each effect of friction has a bristle of its own, which bends before it slips.

LuGre's bristle (Canudas de Wit et al. 1995; with a level of 1 and without damping it is Dahl's, 1968): f is the friction
over its limit at rest, and over a motion x of one direction

    delta df/dx = sign(x) - f/h(v)

with the presliding displacement delta and h the level at a speed over that at rest. A step solves it in closed form. While it bends it is damped,

    force / limit = f + tau df/dt,    tau = 2 zeta sqrt(10 delta / g),

zeta of the critical damping of a dead weight where friction is a tenth of the weight, less where it is less. The paper has 0.5. 0.15 ends the ringing of the bristle in some periods as well, and adds
little to the friction of a slow motion, of which most runs would not tell it. Without damping a load that has come to rest rings for seconds, creeps on as it
rings (Dupont et al. 2002), and takes steps of a millisecond all that time.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import jax.numpy as jnp

from smajax.model.load.base import GRAVITY, AbstractMovingLoad
from smajax.model.load.force import force_at_rest
from smajax.model.types import Inputs, Motion, Scalar

PRESLIDING = 5e-5  # m, where nothing is known of it: asperities bend by micrometres before they slip (Dahl 1968)
WEIGHT_OVER_FRICTION, DAMPING_RATIO = 10.0, 0.15  # of the bristle


class FrictionTerm(abc.ABC):
    """Friction of one effect, with a bristle of its own."""

    effect_name: ClassVar[str]  # its entry of `Motion.friction`

    @abc.abstractmethod
    def friction_limit(self, load_at_rest: Scalar) -> Scalar:
        """Largest friction of the load at rest, N (N m for an arm), where the load itself pulls by `load_at_rest` at its start."""

    def friction_level(self, speed: Scalar) -> Scalar | float:
        """Friction while it slips over that at rest, -, at a speed of the wire's moving end, m/s."""
        return 1.0

    def presliding(self) -> Scalar | float:
        """Motion of the wire's moving end over which the friction builds up, m."""
        return PRESLIDING


class Rubbing(NamedTuple):
    """Friction of one effect at a speed."""

    name: str  # its entry of `Motion.friction`, which is f: the state of the bristle, without the force of its damping
    limit: Scalar  # at rest, N (N m on an arm)
    level: Scalar | float  # h: while it slips, over the limit
    presliding: Scalar | float  # delta, m (rad)
    relaxation: Scalar | float  # tau, s


def rubbing(
    load: AbstractMovingLoad, terms: Sequence[FrictionTerm], before: Motion, velocity: Scalar, inputs: Inputs
) -> list[Rubbing]:
    """All friction of a load on its way from `before`; empty where no effect has any.

    `velocity`: what a stage predicts of its end before it is solved, m/s (rad/s). At that or at the speed before, if that
    is larger: friction that falls with the speed it is solved for has several answers, or none that Newton's method finds.
    """
    if not terms:
        return []
    speed = load.lever() * jnp.maximum(jnp.abs(before.velocity), jnp.abs(velocity))
    at_rest = force_at_rest(load, inputs)
    return [
        Rubbing(
            term.effect_name,
            term.friction_limit(at_rest),
            term.friction_level(speed),
            term.presliding() / load.lever(),
            2.0 * DAMPING_RATIO * jnp.sqrt(WEIGHT_OVER_FRICTION * term.presliding() / GRAVITY),
        )
        for term in terms
    ]


def bent(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """Motion to a position over what its bristle bends by: well beyond -1..1 it slips."""
    return (position - before.position) / one.presliding


def in_use(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """Share of the limit at rest that holds against a motion to `position`, -1..1, without damping."""
    return slipping(one, before, position) - yet_to_bend(one, before, position)


def slipping(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """What `in_use` comes to on a long way in this direction."""
    return jnp.where(bent(one, before, position) < 0.0, -one.level, one.level)


def yet_to_bend(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """What it is less by at `position`."""
    moved = jnp.abs(bent(one, before, position))
    return (slipping(one, before, position) - before.friction[one.name]) * jnp.exp(-moved / one.level)


def holding(one: Rubbing, before: Motion, position: Scalar, velocity: Scalar, time: Scalar) -> Scalar:
    """Force of the friction over its limit at rest at the end of a motion to `position`, with the damping of its bristle.

    The bristle bends at the rate that it has at the end: none where it slips by then, however long the motion is. It lasts `time` (s) and
    ends with `velocity` (m/s, rad/s), which counts in the direction of the motion and up to twice the mean speed: a stage that is
    too long to resolve the bending has one solution.
    """
    moved = bent(one, before, position)
    ahead = jnp.where(moved < 0.0, -velocity, velocity) / one.presliding
    speed = jnp.clip(ahead, 0.0, 2.0 * jnp.abs(moved) / time)
    rest = yet_to_bend(one, before, position)
    return slipping(one, before, position) - rest + one.relaxation * speed * rest / one.level


def unbent(one: Rubbing, before: Motion) -> Scalar:
    """Position at which its friction is none."""
    share = before.friction[one.name]
    back = one.level * jnp.log(1.0 + jnp.abs(share) / one.level)
    return before.position - one.presliding * jnp.sign(share) * back
