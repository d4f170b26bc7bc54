"""What an effect may change in the phase kinetics (eq. 3.3, 3.5, 3.17, 3.18): shape, range or conditions of the branches."""

from __future__ import annotations

import abc
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Bool

from smajax.model.types import Scalar, WireState
from smajax.model.wire.conditions import AbstractConditions
from smajax.model.wire.wire import Kinetics


class ShapeTerm(abc.ABC):  # noqa: B024  # each method by itself is enough
    """Another shape of a branch. The two are then no mirror images of each other, and each is computed by itself."""

    def heating_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        """Share of martensite left at the reduced distance z = (y_A - A_s)/(A_f - A_s); 1 far below, 0 far above."""
        return remaining

    def cooling_shape(self, z: Scalar, remaining: Scalar) -> Scalar:
        """Share of austenite left at the reduced distance z = (y_M - M_f)/(M_s - M_f); 0 far below, 1 far above."""
        return remaining


class PlaceTerm(abc.ABC):  # noqa: B024  # each method by itself is enough
    """Another place at which the law's shape is read. The directions of a step remain those of the distance itself."""

    def heating_place(self, z: Scalar) -> Scalar:
        """Where the shape is read at the reduced distance z; rises with z."""
        return z

    def cooling_place(self, z: Scalar) -> Scalar:
        """Likewise on cooling."""
        return z

    def place_on(self, cooling: Bool[Array, ""], z: Scalar) -> Scalar:
        """On the branch that a step is on, from its start on: on cooling both distances are 1 less those of `cooling_place`.

        Follows from the other two; an effect has it by itself where that is quicker.
        """
        return jnp.where(cooling, 1.0 - self.cooling_place(1.0 - z), self.heating_place(z))


class RangeTerm(abc.ABC):  # noqa: B024  # each method by itself is enough
    """A range that is elsewhere. The direction of a step is then that of the moved distance.

    `moves_within_step`: what transforms in a step moves it, so that where a step ends is the root of an equation.
    """

    moves_within_step: ClassVar[bool] = False

    def heating_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        """The reduced distance itself, from what the law has; `old` is the wire before the step."""
        return z

    def cooling_distance(self, law: Kinetics, z: Scalar, temperature: Scalar, stress: Scalar, old: WireState) -> Scalar:
        """Likewise on cooling."""
        return z


class PopulationTerm(abc.ABC):
    """A share of the wire that follows other branch conditions than the law's (`two_populations.py`)."""

    @abc.abstractmethod
    def second_conditions(self) -> tuple[AbstractConditions, Scalar]:
        """(the conditions, the share, -)."""


class KineticsTerms(NamedTuple):
    """All that effects change in the kinetics of one wire."""

    shapes: tuple[ShapeTerm, ...] = ()
    places: tuple[PlaceTerm, ...] = ()
    ranges: tuple[RangeTerm, ...] = ()
    populations: tuple[PopulationTerm, ...] = ()

    @property
    def shape_branches(self) -> bool:
        """Whether an effect shapes the two branches, which are then no mirror images of each other."""
        return bool(self.shapes)

    @property
    def move_within_step(self) -> bool:
        """Whether what transforms in a step moves its range."""
        return any(term.moves_within_step for term in self.ranges)


NO_TERMS = KineticsTerms()
