"""Where a fit with another shape of the transformation begins: with temperatures between which the same shares of the wire transform as before."""

from __future__ import annotations

from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from smajax.attribution.joint_parameters import JointParameters
from smajax.attribution.set_starts import off_bounds
from smajax.attribution.subset_evidence import Subset
from smajax.attribution.traces import Traces
from smajax.fit.problem import Problem
from smajax.model.effects.library import LIBRARY
from smajax.model.system import System
from smajax.model.wire.kinetics import NARROWEST_RANGE, austenite_left, martensite_left
from smajax.model.wire.kinetics_terms import KineticsTerms

HEATING = ("austenite_start", "austenite_finish")
COOLING = ("martensite_finish", "martensite_start")
LEFT = (0.9, 0.1)  # shares yet to transform, between which a range is kept
POINTS = 2001
AROUND = 4.0  # ranges on either side


def at_every_place(joint: JointParameters, subset: Subset, traces: Traces, start: np.ndarray) -> Iterator[np.ndarray]:
    """`start` (P,) with a new shape of the transformation at its usual size at each of its places (`Candidate.grid`), its temperatures as in `keeping_the_range`.

    Where the fit without the shape is far off, neither its derivatives nor the misfit at a place say at which one it belongs. A second range of two fifths of a
    wire ended at 3.5 noises from the one that the linear model had chosen, and at the noise from three of the four with these temperatures.
    """
    # With what the present model has as well: a shape that goes is in the range that is kept.
    problem, index = joint.restricted(joint.ordered(tuple({*traces.present, *(one.effect for one in subset)})))
    own = [joint.slots[name] for name in joint.unknowns]
    for variant in subset:
        if variant.effect in traces.present or not LIBRARY[variant.effect].candidate.exclusive_group:
            continue
        guesses = LIBRARY[variant.effect].candidate.initial_guess
        usual = {name: guesses[name.split(".", 1)[1]] for name in joint.switches(variant.effect)}
        for other, place in traces.places.items():
            if other.effect != variant.effect:
                continue
            values = np.array(start)
            values[own] = traces.values[own]
            for name, value in {**place, **usual}.items():
                values[joint.slots[name]] = np.clip(value, *joint.bounds[name])
            yield keeping_the_range(joint, problem, index, traces.values, values)


def keeping_the_range(
    joint: JointParameters, problem: Problem, index: np.ndarray, before: np.ndarray, values: np.ndarray
) -> np.ndarray:
    """`values` (P,) with the transformation temperatures at which nine and one tenth of the wire are yet to transform where they are at `before`, on heating and on cooling; as they are where one is not free, or a range is that of nothing. `problem`, `index`: of a program that has the effects of both.

    A shape counts its distance in ranges, z = (y - A_s)/(A_f - A_s), so that another one with the same four temperatures transforms elsewhere.
    """
    if not {*HEATING, *COOLING} <= set(joint.unknowns):
        return values
    changed = np.array(values)
    for branch, names in enumerate((HEATING, COOLING)):
        slots = [joint.slots[name] for name in names]
        (low, high), ends = before[slots], values[slots]
        if min(high - low, ends[1] - ends[0]) < NARROWEST_RANGE:
            continue
        width = max(high - low, ends[1] - ends[0])
        grid = np.linspace(min(low, ends[0]) - AROUND * width, max(high, ends[1]) + AROUND * width, POINTS)
        there, here = (_reached(problem.system_at(jnp.asarray(one[index])), grid, branch) for one in (before, values))
        # In ranges of the new shape, from its own start.
        z = (here - ends[0]) / (ends[1] - ends[0])
        range_now = (there[1] - there[0]) / (z[1] - z[0]) if z[1] > z[0] else np.nan
        begin = there[0] - z[0] * range_now
        if np.isfinite(range_now) and range_now > 0.0:
            changed[slots] = begin, begin + range_now
    return off_bounds(joint, changed)


def _reached(system: System, grid: np.ndarray, branch: int) -> np.ndarray:
    """Temperatures (2,) in degC, without stress, at which `LEFT` is yet to transform, NaN where that is beyond the grid; branch: 0 on heating, 1 on cooling."""
    left = np.asarray(_left(system, jnp.asarray(grid))[branch])
    # On cooling the temperature rises as less has transformed.
    order = slice(None, None, -1) if branch == 0 else slice(None)
    levels = LEFT if branch == 0 else LEFT[::-1]
    return np.interp(levels, left[order], grid[order], left=np.nan, right=np.nan)


@eqx.filter_jit
def _left(system: System, grid: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(martensite left on heating, austenite left on cooling), (POINTS,) each: by the shapes, of a range that nothing else moves."""
    law, own = system.wire.kinetics, system.terms.kinetics
    terms = KineticsTerms(shapes=own.shapes, places=own.places)
    return jax.vmap(
        lambda at: (martensite_left(law, terms, at, jnp.zeros(())), austenite_left(law, terms, at, jnp.zeros(())))
    )(grid)
