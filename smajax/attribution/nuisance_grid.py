"""Grid of nuisance values: at which values of its other coefficients an effect is scanned while its switches are off.

A time, a width or a scale means nothing until the effect is on, but the trace that switching it on would leave depends on
it: a draught is only seen by a score test that looks at about the time at which it blew. Each effect says at which
values to look (`AbstractEffect.places`); the score is taken at the one that promises most.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from smajax.attribution.fit_programs import Effects, compiled_for, samples_of
from smajax.attribution.model_fits import Model, Search, nudged
from smajax.attribution.score_test import Score, ranked, samples_per_independent, score_of, switches, without
from smajax.attribution.traces import by_one_step, by_program, far_from, from_coarse_to_fine
from smajax.fit.outputs_of_runs import begin_derivatives, made_ready, misfits, slopes_at
from smajax.fit.problem import Problem
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.model.effects.library import LIBRARY


@dataclass(frozen=True)
class Scanned:
    """Sensitivities with every effect at its best place; by effect, that place (full names) and among how many it is."""

    at: Sensitivity
    place: dict[str, dict[str, float]] = field(default_factory=dict)
    looks: dict[str, int] = field(default_factory=dict)


def scanned(
    setting: Search,
    values: np.ndarray,
    effects: Sequence[str],
    fitted: Sequence[str],
    present: Sequence[str] = (),
    looked_for: Sequence[str] | None = None,
    compiled: Sequence[Effects] = (),
) -> Scanned:
    """Misfit and its derivatives at `values` (P,) of a model with the effects `present`, where `fitted` are the loose parameters.

    `effects`, which are off, are each at the place whose trace promises most beside what the fitted parameters absorb. `looked_for`, `compiled`: as of
    `traces_at`.
    """
    programs, carried = _carried(setting, effects, present, looked_for, compiled)
    restricted = [setting.restricted(one) for one in carried]
    own, index = setting.restricted(present)
    misfit = misfits(own, [values[index]])[0] / np.asarray(own.noise)
    slots = [slots for _, slots in restricted]
    for problems in from_coarse_to_fine([problem for problem, _ in restricted]):  # the programs of the search's traces
        parts, traces = _scanned_by(setting, values, fitted, programs, problems, slots)
        if not far_from(parts[0].misfit, misfit):
            break
    jacobian = np.concatenate([one.jacobian for one in parts], axis=-1)
    at = Sensitivity(tuple(name for one in parts for name in one.names), misfit, jacobian, parts[0].mask)
    found = Scanned(at)
    basis, residual = without(at, fitted)
    correlation = samples_per_independent(at)
    best: dict[str, float] = {}
    for effect, place, columns in traces:
        if effect not in best:
            best[effect] = score_of((effect,), at, basis, residual, setting.bounds, correlation).gain
        found.looks[effect] = found.looks.get(effect, 1) + 1
        there = Sensitivity(tuple(columns), at.misfit, np.stack(list(columns.values()), axis=-1), at.mask)
        score = score_of((effect,), there, basis, residual, setting.bounds, correlation)
        if score.gain > best[effect]:
            best[effect], found.place[effect] = score.gain, place
            for name, column in columns.items():
                jacobian[..., at.names.index(name)] = column
    return found


def begin_scores(
    setting: Search,
    present: Sequence[str],
    candidates: Sequence[str],
    looked_for: Sequence[str] | None,
    compiled: Sequence[Effects],
) -> None:
    """Have a second process, where there is one, make the programs of `scores_at` a model with the effects `present`, of the other `candidates`, by one step a sample."""
    left = [effect for effect in candidates if effect not in present]
    carried = _carried(setting, left, present, looked_for, compiled)[1] if left else []
    begin_derivatives(by_one_step([setting.restricted(one)[0] for one in carried]))


def _carried(
    setting: Search,
    effects: Sequence[str],
    present: Sequence[str],
    looked_for: Sequence[str] | None,
    compiled: Sequence[Effects],
) -> tuple[list[list[str]], list[Effects]]:
    """(effects that each program looks at, those that it carries). Arguments as of `scanned`."""
    samples = samples_of(setting.problem)
    programs = by_program(effects, looked_for, samples)
    return programs, [compiled_for((*present, *together), compiled, samples) for together in programs]


Places = list[tuple[str, dict[str, float], dict[str, np.ndarray]]]


def _scanned_by(
    setting: Search,
    values: np.ndarray,
    fitted: Sequence[str],
    programs: Sequence[Sequence[str]],
    problems: Sequence[Problem],
    slots: Sequence[Sequence[int]],
) -> tuple[list[Sensitivity], Places]:
    """(sensitivities by program, what `_at_places` gives of all) by `problems`; `slots`: of the parameters of each among all."""
    parts: list[Sensitivity] = []
    traces: Places = []
    made_ready(problems)
    for together, problem, own in zip(programs, problems, slots, strict=True):
        # What is fitted from the first: once is enough.
        names = [*(() if parts else fitted), *(name for effect in together for name in setting.coefficients(effect))]
        parts.append(sensitivity(problem, nudged(setting, values, together)[own], names))
        traces += _at_places(setting, problem, own, values, together)
    return parts, traces


def _at_places(
    setting: Search, problem: Problem, slots: Sequence[int], values: np.ndarray, effects: Sequence[str]
) -> Places:
    """(effect, a place of its grid, columns (series, N) of its switches there), by full names. `slots`: of the parameters of `problem` among all."""
    found: Places = []
    points, names = [], []
    for effect in effects:
        for grid in LIBRARY[effect].candidate.grid(setting.extent):
            place = {f"{effect}.{name}": one for name, one in grid.items()}
            here = nudged(setting, values, [effect])
            for name, one in place.items():
                here[setting.problem.names.index(name)] = np.clip(one, *setting.bounds[name])
            found.append((effect, place, {}))
            for name in switches(effect):
                points.append(here[slots])
                names.append(name)
    columns = iter(-slopes_at(problem, points, names) / np.asarray(problem.noise))
    for effect, _, own in found:
        own.update({name: next(columns) for name in switches(effect)})
    return found


def scores_at(
    setting: Search,
    model: Model,
    left: Sequence[str],
    looked_for: Sequence[str] | None = None,
    compiled: Sequence[Effects] = (),
) -> list[Score]:
    """Score tests of the effects not yet in `model`, at its fit, the largest gain first; having looked at several places counts against one.

    `looked_for`, `compiled`: as of `traces_at`.
    """
    loose = setting.loose(model.effects, model.values)
    looked = scanned(setting, model.values, left, loose, model.effects, looked_for, compiled)
    scores = ranked(looked.at, loose, left, setting.bounds)
    return [
        dataclasses.replace(score, p_value=min(1.0, score.p_value * looked.looks.get(score.effects[0], 1)))
        for score in scores
    ]
