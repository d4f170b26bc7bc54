"""Traces of all candidate effects in the runs, at one fitted model: derivatives of the outputs by every coefficient.

A time, a width or a scale of an effect means nothing while the effect is off, but the trace of switching it on depends on
it: an effect may give several places at which to look (`Candidate.grid`), and each is a variant of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from smajax.attribution.exclusive_effects import of_groups
from smajax.attribution.fit_programs import Effects, compiled_for, samples_of
from smajax.attribution.joint_parameters import NUDGE, JointParameters, residual_and_columns
from smajax.attribution.laplace_evidence import FittedModel
from smajax.fit.integration import with_integration
from smajax.fit.outputs_of_runs import begin_derivatives, made_ready, slopes_at
from smajax.fit.problem import Problem
from smajax.model.drive.inputs import InputLagTerm
from smajax.model.effects.candidate import Extent
from smajax.model.effects.library import LIBRARY
from smajax.simulation.steppers import ONE_STEP

MANY = 5_000  # samples of all runs, from which on a linear model takes longer than compiling a program for it
# Effects of a program: 47 in two take 4.0 s to compile and in one 4.4, and half the time to run; in three 4.5.
MOST = 24
MOST_OFF = 1.0  # of what a model leaves, root mean square: what one step a sample may be off by where derivatives are taken by it


class Variant(NamedTuple):
    """An effect, and at which of its places it is switched on; -1 where it is, or where it begins by itself."""

    effect: str
    place: int


@dataclass(frozen=True)
class Traces:
    """At `values` (P,) of a model that has the effects `present`; columns are on the n measured samples, in SI."""

    values: np.ndarray
    present: tuple[str, ...]
    residual: np.ndarray  # (n,) measured minus predicted
    columns: Mapping[str, np.ndarray]  # (n,), by unknowns and coefficients
    variants: Mapping[Variant, Mapping[str, np.ndarray]]  # columns of each variant's coefficients
    places: Mapping[Variant, Mapping[str, float]]  # values there, by full name
    compiled: tuple[Effects, ...] = ()  # effects that each program of traces so far carries


def traces_at(
    joint: JointParameters,
    model: FittedModel,
    extent: Extent,
    candidates: Sequence[str] | None = None,
    looked_for: Sequence[str] | None = None,
    compiled: Sequence[Effects] = (),
) -> Traces:
    """Residual of a fitted model and derivatives there; effects that are off are switched on by `NUDGE` for theirs.

    `candidates`: effects that are looked at beside those of the model; None: all. `looked_for`: as of `by_program`. `compiled`: effects that programs of traces carry which are compiled already. Derivatives by one step of the integration a
    sample, which only say which sets of effects are worth a fit, unless that is far off.
    """
    values, present = model.values, model.effects
    among, programs, carried = _carried(joint, present, candidates, looked_for, compiled)
    restricted = [joint.restricted(one) for one in carried]
    shared = joint.free([effect for effect in among if effect in present])
    for problems in from_coarse_to_fine([problem for problem, _ in restricted]):
        residual, columns, variants, places = _traced(joint, values, shared, programs, problems, restricted, extent)
        if not far_from(residual, model.residual):
            break
    by_themselves = {
        Variant(effect, -1): {name: columns[name] for name in joint.coefficients[effect]} for effect in among
    }
    every = tuple(dict.fromkeys([*compiled, *carried]))
    return Traces(np.asarray(values), present, model.residual, columns, {**by_themselves, **variants}, places, every)


def begin_traces(
    joint: JointParameters,
    present: Sequence[str] = (),
    candidates: Sequence[str] | None = None,
    compiled: Sequence[Effects] = (),
) -> None:
    """Have a second process, where there is one, make the programs of `traces_at` a model that has the effects `present`, by one step a sample."""
    carried = _carried(joint, present, candidates, None, compiled)[2]
    begin_derivatives(by_one_step([joint.restricted(one)[0] for one in carried]))


def _carried(
    joint: JointParameters,
    present: Sequence[str],
    candidates: Sequence[str] | None,
    looked_for: Sequence[str] | None,
    compiled: Sequence[Effects],
) -> tuple[tuple[str, ...], list[list[str]], list[Effects]]:
    """(effects that are looked at, those that are traced by each program, those that it carries). Arguments as of `traces_at`."""
    among = joint.ordered(tuple(joint.coefficients) if candidates is None else (*present, *candidates))
    absent = [effect for effect in among if effect not in present]
    samples = samples_of(joint.problem)
    programs = by_program(absent, looked_for, samples)
    # What a program of an earlier search carried may be in the base model since: an input that was recorded wrongly.
    known = [joint.ordered(one) for one in compiled]
    return among, programs, [compiled_for(joint.ordered((*present, *one)), known, samples) for one in programs]


def by_one_step(problems: Sequence[Problem]) -> list[Problem]:
    """The same with one step a sample."""
    return [with_integration(problem, ONE_STEP) for problem in problems]


def from_coarse_to_fine(problems: Sequence[Problem]) -> Iterator[list[Problem]]:
    """By one step a sample, and by their own integration."""
    yield by_one_step(problems)
    yield list(problems)


def far_from(coarse: np.ndarray, own: np.ndarray) -> bool:
    """Whether misfits by one step a sample are off by as much as the model leaves: their derivatives then are not the model's.

    A step of a slider that turns may be too long for its stages to be solved at all.
    """
    return not float(np.mean((coarse - own) ** 2)) <= MOST_OFF**2 * float(np.mean(own**2))


def _traced(
    joint: JointParameters,
    values: np.ndarray,
    shared: Sequence[str],
    programs: Sequence[Sequence[str]],
    problems: Sequence[Problem],
    restricted: Sequence[tuple[Problem, np.ndarray]],
    extent: Extent,
) -> tuple[
    np.ndarray,
    dict[str, np.ndarray],
    dict[Variant, Mapping[str, np.ndarray]],
    dict[Variant, Mapping[str, float]],
]:
    """(residual, columns, columns of variants, their places) by `problems`; `shared`: parameters that are free without any effect more."""
    columns: dict[str, np.ndarray] = {}
    variants: dict[Variant, Mapping[str, np.ndarray]] = {}
    places: dict[Variant, Mapping[str, float]] = {}
    residual = np.zeros(0)
    made_ready(problems)
    for together, problem, (_, index) in zip(programs, problems, restricted, strict=True):
        # Those that all programs share from the first: once is enough.
        names = [
            *(() if columns else shared),
            *(name for effect in together for name in joint.coefficients[effect]),
        ]
        own, found = residual_and_columns(problem, _nudged(joint, values, together)[index], names)
        residual = residual if columns else own
        columns |= found
        there = _places(joint, together, extent)
        variants |= _elsewhere(joint, problem, index, values, there)
        places |= there
    return residual, columns, variants, places


def by_program(effects: Sequence[str], looked_for: Sequence[str] | None = None, samples: int = 0) -> list[list[str]]:
    """Effects in the programs that compute their traces; one, of none, where there are none.

    Effects of a group that exclude each other are apart from the others: each of these would be computed with all of those in every step. On a
    bias-spring bench 48 effects take 0.8 s in two programs and 1.9 s in one, and half the time to compile. So are, where the runs have many `samples`, those
    that shift an input: beside them every step has three parts, and the others take a third of the time without. Those that the search does not look for have a program of their own too, so that the others share the search's; `looked_for`: None for all.
    No program has more than `MOST` effects: a step computes all of them for the derivative of one.
    """
    among = effects if looked_for is None else [effect for effect in effects if effect in looked_for]
    apart = list(of_groups(among))
    late = [effect for effect in among if samples > MANY and issubclass(LIBRARY[effect], InputLagTerm)]
    others = [effect for effect in among if effect not in apart and effect not in late]
    rest = [effect for effect in effects if effect not in among]
    return [part for one in (others, apart, late, rest) for part in _parts(one)] or [[]]


def _parts(effects: Sequence[str]) -> list[list[str]]:
    """At most `MOST` effects each, as many in one as in another."""
    count = -(-len(effects) // MOST)
    edges = [len(effects) * part // count for part in range(count + 1)] if count else []
    return [list(effects[first:last]) for first, last in pairwise(edges)]


def _places(joint: JointParameters, effects: Sequence[str], extent: Extent) -> dict[Variant, Mapping[str, float]]:
    """Where effects that are off are looked at beside where they begin by themselves."""
    return {
        Variant(effect, number): {
            f"{effect}.{name}": float(np.clip(value, *joint.bounds[f"{effect}.{name}"]))
            for name, value in place.items()
        }
        for effect in effects
        for number, place in enumerate(LIBRARY[effect].candidate.grid(extent))
    }


def _elsewhere(
    joint: JointParameters,
    problem: Problem,
    index: np.ndarray,
    values: np.ndarray,
    places: Mapping[Variant, Mapping[str, float]],
) -> dict[Variant, Mapping[str, np.ndarray]]:
    """Columns of the switches of effects that are off, at their places. `index`: of the parameters of `problem` among all."""
    points, owners = [], []
    for variant, place in places.items():
        point = np.array(values)
        point[[joint.slots[name] for name in place]] = list(place.values())
        point = _nudged(joint, point, [variant.effect])
        for name in joint.switches(variant.effect):
            points.append(point[index])
            owners.append((variant, name))
    keep = np.asarray(problem.batch.mask) > 0
    found: dict[Variant, dict[str, np.ndarray]] = {}
    for (variant, name), slope in zip(owners, slopes_at(problem, points, [name for _, name in owners]), strict=True):
        found.setdefault(variant, {})[name] = slope[keep]
    return dict(found)


def _nudged(joint: JointParameters, values: np.ndarray, effects: Sequence[str]) -> np.ndarray:
    changed = np.array(values)
    for effect in effects:
        for name in joint.switches(effect):
            changed[joint.slots[name]] += NUDGE * joint.priors[name].sigma
    return changed
