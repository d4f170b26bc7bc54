"""What the wire has to overcome: the load's own resistance, and what effects add to it."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp

from smajax.model.load.base import AbstractMovingLoad
from smajax.model.types import Inputs, Scalar


class EndMotion(NamedTuple):
    """Motion of the wire's moving end, and the load on it."""

    displacement: Scalar  # from the start, m, positive when the wire contracts
    speed: Scalar  # m/s
    static_force: Scalar  # of the load's weight and springs there, against contraction, N
    time: Scalar  # from the start of the run, s


class ForceTerm(abc.ABC):
    """What an effect may change in the equation of motion (eq. 3.8, 3.13)."""

    @abc.abstractmethod
    def resisting_force(self, load: AbstractMovingLoad, at: EndMotion) -> Scalar | float:
        """Force against contraction beside the load's, N; a change of the load itself is a share of its static force."""


def force_at_rest(load: AbstractMovingLoad, inputs: Inputs) -> Scalar:
    """Size of what the load at rest pulls by at its start, N (N m for an arm)."""
    start = jnp.asarray(load.start())
    return jnp.abs(load.resistance(start, jnp.zeros_like(start), inputs))


def load_resistance(
    load: AbstractMovingLoad,
    terms: Sequence[ForceTerm],
    time: Scalar,
    position: Scalar,
    velocity: Scalar,
    inputs: Inputs,
) -> Scalar:
    """What the wire has to overcome, N (N m for an arm); `position` and `velocity` in m (rad) and m/s (rad/s)."""
    resistance = load.resistance(position, velocity, inputs)
    if not terms:
        return resistance
    lever = load.lever()
    static = load.resistance(position, jnp.zeros_like(position), inputs) / lever
    at = EndMotion(lever * (position - load.start()), lever * velocity, static, time)
    return resistance + lever * sum(term.resisting_force(load, at) for term in terms)
