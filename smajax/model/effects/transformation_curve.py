"""The curve of the transformation: how wide a range each part of it takes, on heating and on cooling."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool

from smajax.core.parameters import parameter
from smajax.model.effects.base import AbstractEffect
from smajax.model.effects.candidate import TRANSFORMATION_SHAPE, Actuator, Candidate, Width
from smajax.model.types import Scalar
from smajax.model.wire.kinetics_terms import PlaceTerm
from smajax.model.wire.monotone_curve import MonotoneCurve, monotone_curve
from smajax.model.wire.shape import Cosine

_PARTS = ("inner", "middle", "outer")  # from the middle of the transformation outwards
_FIELDS = {
    branch: tuple(f"{branch}_{side}_{part}" for side in ("start", "finish") for part in _PARTS)
    for branch in ("heating", "cooling")
}
_ALL = (*_FIELDS["heating"], *_FIELDS["cooling"])
_WIDTH = Width(0.7, "an estimate: a part is half to twice as wide as its neighbour, against the cosine; three add up")


def _follows_the_cosine(system: Actuator) -> bool:
    # The knots are shares of the cosine's transformation; the exponential of Tanaka's law has a corner where they have a smooth start.
    return isinstance(system.wire.kinetics.shape, Cosine)


def _part(about: str) -> Scalar:
    field: Scalar = parameter(
        "-", -3.0, 3.0, f"{about}: ln of its width over its inner neighbour's, against the cosine's", default=0.0
    )
    return field


class BranchShape(NamedTuple):
    """A branch against the cosine: how wide its parts are, each over what lies between a tenth and nine tenths of it."""

    first_tenth: float  # over the cosine's, -
    last_tenth: float  # over the cosine's, -
    halves: float  # from a tenth to a half, over from a half to nine tenths, -; 1 in the cosine
    first_step: float | None  # share before the slowest tenth between two faster ones; None without one


class TransformationCurve(AbstractEffect, PlaceTerm):
    r"""$h = h_{cos}(\varphi(z))$ with $\varphi$ monotone through eight knots, of its own on heating and on cooling.

    The seven parts between the knots are as wide as the law has them times $e^s$, $s$ adding up from the middle part outwards
    (`wire.monotone_curve`): smooth starts and ends, tails, asymmetry. A fifth and four fifths of a branch stay where
    they are; A_s, A_f, M_s and M_f are then those of the cosine through these two places, and not where it starts and finishes.
    """

    heating_start_inner: Scalar = _part("heating, first third, inner part")
    heating_start_middle: Scalar = _part("heating, first third, middle part")
    heating_start_outer: Scalar = _part("heating, first third, outer part")
    heating_finish_inner: Scalar = _part("heating, last third, inner part")
    heating_finish_middle: Scalar = _part("heating, last third, middle part")
    heating_finish_outer: Scalar = _part("heating, last third, outer part")
    cooling_start_inner: Scalar = _part("cooling, first third, inner part")
    cooling_start_middle: Scalar = _part("cooling, first third, middle part")
    cooling_start_outer: Scalar = _part("cooling, first third, outer part")
    cooling_finish_inner: Scalar = _part("cooling, last third, inner part")
    cooling_finish_middle: Scalar = _part("cooling, last third, middle part")
    cooling_finish_outer: Scalar = _part("cooling, last third, outer part")

    curves: dict[str, MonotoneCurve] | None = None  # of the branches, once they are computed (`prepared`)

    effect_name: ClassVar[str] = "transformation_curve"
    candidate: ClassVar[Candidate] = Candidate(
        title="curve of the transformation",
        equation="kinetics",
        formula="h(z) -> h(phi(z)) in eq. 3.3 and 3.5, phi monotone through eight knots, by branch",
        sentence="The transformation does not run through its range as the cosine does: it starts or ends slowly or sharply, has "
        "a tail, or goes in two steps.",
        switches=_ALL,
        initial_guess={name: 0.4 if name.endswith("outer") else 0.1 for name in _ALL},
        applies=_follows_the_cosine,
        exclusive_group=TRANSFORMATION_SHAPE,
        keeps_priors=True,
        further_starts=(dict.fromkeys(_ALL, 0.7), {name: 0.7 if name.endswith("outer") else -0.4 for name in _ALL}),
        prior_class="material",
        widths=dict.fromkeys(_ALL, _WIDTH),
    )

    def prepared(self) -> TransformationCurve:
        """The same with the curves of both branches computed."""
        return dataclasses.replace(self, curves={branch: self._curve(branch) for branch in _FIELDS})

    def heating_place(self, z: Scalar) -> Scalar:
        return self._moved(z, "heating")

    def cooling_place(self, z: Scalar) -> Scalar:
        return 1.0 - self._moved(1.0 - z, "cooling")  # z falls from 1 to 0 on cooling

    def place_on(self, cooling: Bool[Array, ""], z: Scalar) -> Scalar:
        heated, cooled = (self._curve(branch) for branch in ("heating", "cooling"))
        return jax.tree.map(partial(jnp.where, cooling), cooled, heated)(z)  # one of the two curves is looked up

    def _moved(self, distance: Scalar, branch: str) -> Scalar:
        return self._curve(branch)(distance)

    def _curve(self, branch: str) -> MonotoneCurve:
        if self.curves is not None:
            return self.curves[branch]
        return _curve_of([getattr(self, name) for name in _FIELDS[branch]])


def _curve_of(parts: Sequence[Scalar]) -> MonotoneCurve:
    return monotone_curve(parts[: len(_PARTS)], parts[len(_PARTS) :])


@jax.jit
def _places(parts: Sequence[Array], z: Array) -> Array:
    """One program: of its operations one by one JAX would compile thirty."""
    return jax.vmap(_curve_of(parts))(z)


def branch_shape(values: Mapping[str, float], branch: str) -> BranchShape:
    """The shape of one branch ("heating" or "cooling") with coefficients by their own names; those not given are zero."""
    parts = [np.asarray(values.get(name, 0.0)) for name in _FIELDS[branch]]
    reach = 12.0 * np.exp(sum(abs(values.get(name, 0.0)) for name in _FIELDS[branch]) / 2.0)
    # Dense about the middle, where a step may be sharp, and reaching as far as a tail.
    z = 0.5 + np.sinh(np.linspace(-1.0, 1.0, 20001) * np.arcsinh(reach * 50.0)) / 50.0
    in_cosine = 2.0 / np.pi * np.arcsin(np.sqrt(np.arange(11) / 10.0))
    width = np.diff(np.interp(in_cosine, np.asarray(_places(parts, z)), z))
    usual = np.diff(in_cosine)
    between, usually = float(width[1:-1].sum()), float(usual[1:-1].sum())
    return BranchShape(
        float(width[0] / usual[0]) * usually / between,
        float(width[-1] / usual[-1]) * usually / between,
        float(width[1:5].sum() / width[5:-1].sum()),
        _first_step(width),
    )


def _first_step(width: np.ndarray) -> float | None:
    """Share before the slowest inner tenth, where a tenth before it and one after it are at most half as wide; else None.

    width: of the ten tenths, -.
    """
    slow = [k for k in range(1, 9) if width[k] >= 2.0 * max(width[:k].min(), width[k + 1 :].min())]
    return (max(slow, key=lambda k: float(width[k])) + 0.5) / 10.0 if slow else None
