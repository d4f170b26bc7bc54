r"""Solves a stage: Newton's method for heat, motion and stress, and within each step the one equation of the kinetics.

As in plasticity, a stage is first tried with the fraction frozen; that decides the branch. Linearised, the three equations
give temperature and stress as straight lines over the fraction, and on the branch

    xi - xi(T(xi), sigma(xi)) = 0

is one equation of one unknown. It rises with xi (more martensite: warmer by latent heat and less stressed, so less of
it), so its root lies between the present fraction and the end of the branch. The cosine is all that bends much in a
stage, and it is solved without a new linearisation.

Two linearisations are nearly always enough (`studies/benchmarks` says how often), and cost the same for every run of a
batch. Where the second still moved the solution by `Stage.enough`, more follow, with the inner equation solved to the end in
its bracket: a run that needs them makes its batch wait, and changes nothing for the others.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from functools import reduce
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool

from smajax.core.traced_once import traced_once
from smajax.model.load.base import AbstractMovingLoad
from smajax.model.load.friction import bent, rubbing, unbent
from smajax.model.system import System
from smajax.model.types import Inputs, Scalar
from smajax.model.wire.constitutive import young_modulus
from smajax.model.wire.kinetics import (
    Branch,
    cooling_temperature,
    heating_temperature,
)
from smajax.model.wire.root import bracketed
from smajax.model.wire.two_populations import choose_branch, curve_on, open_branches
from smajax.simulation.stage_equations import Stage, Unknowns, equations

INNER = (3, 1)  # steps of the inner equation after the first two linearisations
CLOSE = 1e-6  # last step of it after later ones
MOST_ITERATIONS = 50
UNDAMPED = 12  # iterations before every second step is halved
# Enough: when no unknown moves by more than `Stage.enough` of its scale, 1 C, 1 % strain, 1e-4 E, and xi in full; in
# float32, by more than what rounding alone moves it. The step after would move it by about the square of that.
ROUNDINGS = 1e3
DRIVING = (heating_temperature, cooling_temperature)  # both linear in temperature and stress
Entry = Scalar | None  # of a Jacobian; None: zero whatever the values, and never computed


class Solution(NamedTuple):
    """The unknowns at the end of a stage, and the branch that it is on."""

    z: Unknowns
    branch: Branch
    free: Scalar  # displacement without end stops
    unsolved: Scalar  # 1 where `MOST_ITERATIONS` were not enough, else 0


class _Iterate(NamedTuple):
    z: Unknowns
    branch: Branch
    free: Scalar
    enough: Scalar  # bool
    iterations: Scalar


def _over(value: Scalar, pivot: Entry) -> Scalar:
    assert pivot is not None, "each equation contains the unknown that it is solved for"
    return value / pivot


def _less(value: Entry, factor: Entry, other: Entry) -> Entry:
    """value - factor * other."""
    if factor is None or other is None:
        return value
    return -factor * other if value is None else value - factor * other


def solved_linear(rows: Sequence[Sequence[Entry]], *rights: Sequence[Entry]) -> list[list[Scalar]]:
    """Solutions of one small linear system for several right-hand sides, none of them zero throughout, without pivoting.

    In the order T, x, sigma every pivot is positive: heat, inertia and stiffness are.
    """
    left, right = [list(row) for row in rows], [list(one) for one in rights]
    size = len(left)
    for pivot in range(size - 1):
        for row in range(pivot + 1, size):
            entry = left[row][pivot]
            if entry is None:
                continue
            factor = _over(entry, left[pivot][pivot])
            for column in range(pivot + 1, size):
                left[row][column] = _less(left[row][column], factor, left[pivot][column])
            for one in right:
                one[row] = _less(one[row], factor, one[pivot])
    for one in right:
        for row in range(size - 1, -1, -1):
            for column in range(row + 1, size):
                one[row] = _less(one[row], left[row][column], one[column])
            own = one[row]
            one[row] = None if own is None else _over(own, left[row][row])
    some = next(entry for one in right for entry in one if entry is not None)
    return [[jnp.zeros_like(some) if entry is None else entry for entry in one] for one in right]


@traced_once
def _linearised(system: System, stage: Stage, inputs: Inputs, z: Unknowns) -> tuple[list[Scalar], list[list[Entry]]]:
    """(what `equations` says, its derivatives by the four unknowns)."""
    columns = []
    residuals: list[Scalar] = []
    for field in Unknowns._fields:
        # One unknown at a time: what does not depend on it is then known to have no derivative and is never computed,
        # which a batched `jacfwd` cannot know.
        def along(value: Scalar, field: str = field) -> list[Scalar]:
            return list(equations(system, stage, inputs, z._replace(**{field: value})))

        here = getattr(z, field)
        residuals, column = eqx.filter_jvp(along, (here,), (jnp.ones_like(here),))
        columns.append(column)
    return residuals, [list(row) for row in zip(*columns, strict=True)]


def _moves(system: System, change: Sequence[Scalar], tolerance: float) -> Bool[Array, ""]:
    """Whether any unknown changes by more than this share of 1 C, 1 % strain, 1e-4 E of the softer phase, xi in full."""
    load = system.load
    assert isinstance(load, AbstractMovingLoad)
    phases = (jnp.full_like(change[0], phase) for phase in (0.0, 1.0))
    softer = jnp.minimum(*(young_modulus(system.wire, phase, system.terms.constitutive) for phase in phases))
    scales: list[Scalar | float] = [1.0, 0.01 / load.contraction(system.wire), 1e-4 * softer, 1.0]
    # NaN counts as not moving: it stays NaN, and must not hold up the others.
    return reduce(operator.or_, [jnp.abs(one) > tolerance * scale for one, scale in zip(change, scales, strict=True)])


def _nearly(miss: Callable[[Scalar], Scalar], start: Scalar, low: Scalar, high: Scalar, steps: int) -> Scalar:
    """The root of `miss` after a few steps of Newton, held between its ends."""
    here = start
    for _ in range(steps):
        value, slope = jax.jvp(miss, (here,), (jnp.ones_like(here),))
        free = here - value / slope
        here = jnp.where(free > high, high, jnp.where(free < low, low, free))
    return here


@traced_once
def solve(system: System, stage: Stage, inputs: Inputs) -> Solution:
    """The end of a stage. Not to be differentiated: its equations are (`stage_equations`)."""
    law, terms, load, old = system.wire.kinetics, system.terms.kinetics, system.load, stage.old.wire
    assert isinstance(load, AbstractMovingLoad)
    xi = old.martensite_fraction
    open_at_start = open_branches(law, terms, old)
    before = stage.old.motion
    slips = rubbing(load, system.terms.friction, before, stage.velocity, inputs)
    tolerance = max(stage.enough, ROUNDINGS * float(jnp.finfo(xi.dtype).eps))

    def iterate(at: _Iterate, number: int | None) -> _Iterate:
        """One linearisation more; `number` of the first two, None for later ones."""
        z = at.z
        (*residuals, free), (*rows, free_row) = _linearised(system, stage, inputs, z)
        by_fraction = [None if row[3] is None else -row[3] for row in rows]
        base, slope = solved_linear([row[:3] for row in rows], [-value for value in residuals], by_fraction)

        def along(fraction: Scalar) -> tuple[Scalar, Scalar]:
            """(T, sigma) that go with a fraction."""
            moved = fraction - z.fraction
            return z.temperature + base[0] + slope[0] * moved, z.stress + base[2] + slope[2] * moved

        tried = along(xi)
        branch = choose_branch(law, terms, old, open_at_start, *tried)

        def miss(fraction: Scalar) -> Scalar:
            return fraction - curve_on(law, terms, old, branch, *along(fraction))

        low, high = jnp.where(branch.heating, 0.0, xi), jnp.where(branch.cooling, 1.0, xi)
        start = z.fraction
        if number == 0:
            # Where the driving temperature is the one before: on a fast way that holds far better than the fraction.
            drive = jax.tree.map(
                lambda heated, cooled: jnp.where(branch.cooling, cooled, heated),
                *(
                    [of(law, *at) for at in ((old.temperature, old.stress), tried, (slope[0], slope[2]))]
                    for of in DRIVING
                ),
            )
            start = xi + (drive[0] - drive[1]) / jnp.where(drive[2] > 0.0, drive[2], jnp.inf)
        inside = jnp.where(start > high, high, jnp.where(start < low, low, start))
        if number is None:
            result = bracketed(miss, inside, low, high, CLOSE)
        else:
            result = _nearly(miss, inside, low, high, INNER[number])
        moved = result - z.fraction
        step = [base[k] + slope[k] * moved for k in range(3)] + [moved]
        if number is None:
            # A stiff-soft-stiff wire (detwinning) can send Newton to and fro between its two stiff ends.
            late = (at.iterations > UNDAMPED) & (at.iterations % 2 == 0)
            step = [jnp.where(late, 0.5 * change, change) for change in step]
        new = Unknowns(*(value + change for value, change in zip(z, step, strict=True)))
        for one in slips:
            # Friction passes through sticking on its way from one slip to the other.
            here, there = (bent(one, before, stage.position + end.displacement) for end in (z, new))
            jumped = (one.limit > 0.0) & (jnp.abs(here) > 1.0) & (jnp.abs(there) > 1.0) & (here * there < 0.0)
            new = new._replace(displacement=jnp.where(jumped, unbent(one, before) - stage.position, new.displacement))
            step[1] = new.displacement - z.displacement
        free = free + sum(entry * change for entry, change in zip(free_row, step, strict=True) if entry is not None)
        if number == 0:  # it solves the inner equation roughly only
            return _Iterate(new, branch, free, no, at.iterations + 1)
        same = (branch.heating == at.branch.heating) & (branch.cooling == at.branch.cooling)
        return _Iterate(new, branch, free, ~_moves(system, step, tolerance) & same, at.iterations + 1)

    no = jnp.zeros_like(xi, bool)
    guess = Unknowns(old.temperature, stage.old.motion.position - stage.position, old.stress, xi)
    at = _Iterate(guess, Branch(no, no), guess.displacement, no, jnp.zeros_like(xi, int))
    for number in range(len(INNER)):
        at = iterate(at, number)
    at = lax.while_loop(
        lambda now: ~now.enough & (now.iterations < MOST_ITERATIONS), lambda now: iterate(now, None), at
    )
    return Solution(at.z, at.branch, at.free, jnp.where(at.enough, 0.0, jnp.ones_like(xi)))
