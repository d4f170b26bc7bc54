r"""Friction of a load's guide: each effect of friction has a bristle of its own, which bends before it slips.

LuGre's bristle without damping of its own (Canudas de Wit et al. 1995; with a level of 1 it is Dahl's, 1968): f is the friction
over its limit at rest, and over a motion x of one direction

    delta df/dx = sign(x) - f/h(v)

with the presliding displacement delta and h the level at a speed over that at rest. A step solves it in closed form.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import jax.numpy as jnp

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.force import force_at_rest
from smajax.model.types import Inputs, Motion, Scalar

PRESLIDING = 5e-5  # m, where nothing is known of it: asperities bend by micrometres before they slip (Dahl 1968)


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

    name: str  # its entry of `Motion.friction`
    limit: Scalar  # at rest, N (N m on an arm)
    level: Scalar | float  # h: while it slips, over the limit
    presliding: Scalar | float  # delta, m (rad)


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
        )
        for term in terms
    ]


def bent(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """Motion to a position over what its bristle bends by: well beyond -1..1 it slips."""
    return (position - before.position) / one.presliding


def in_use(one: Rubbing, before: Motion, position: Scalar) -> Scalar:
    """Share of the limit at rest that holds against a motion to `position`, -1..1."""
    moved = bent(one, before, position)
    slipping = jnp.where(moved < 0.0, -one.level, one.level)
    return slipping + (before.friction[one.name] - slipping) * jnp.exp(-jnp.abs(moved) / one.level)


def unbent(one: Rubbing, before: Motion) -> Scalar:
    """Position at which its friction is none."""
    share = before.friction[one.name]
    back = one.level * jnp.log(1.0 + jnp.abs(share) / one.level)
    return before.position - one.presliding * jnp.sign(share) * back
