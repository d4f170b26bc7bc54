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

from smajax.attribution.model_fits import Model, Search, nudged
from smajax.attribution.score_test import Score, ranked, samples_per_independent, score_of, switches, without
from smajax.fit.integration import with_integration
from smajax.fit.outputs_of_runs import predicted_and_derivatives
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.model.effects.library import LIBRARY
from smajax.simulation.steppers import ONE_STEP


@dataclass(frozen=True)
class Scanned:
    """Sensitivities with every effect at its best place; by effect, that place (full names) and among how many it is."""

    at: Sensitivity
    place: dict[str, dict[str, float]] = field(default_factory=dict)
    looks: dict[str, int] = field(default_factory=dict)


def scanned(setting: Search, values: np.ndarray, effects: Sequence[str], fitted: Sequence[str]) -> Scanned:
    """Misfit and its derivatives at `values` (P,), where `fitted` are the loose parameters.

    `effects`, which are off, are each at the place whose trace promises most beside what the fitted parameters absorb.
    """
    problem = with_integration(setting.problem, ONE_STEP)  # the program of the search's traces
    at = sensitivity(problem, nudged(setting, values, effects), setting.every)
    options = [
        (effect, {f"{effect}.{name}": one for name, one in place.items()})
        for effect in effects
        for place in LIBRARY[effect].candidate.grid(setting.extent)
    ]
    if not options:
        return Scanned(at)
    index = setting.problem.names.index
    points, towards, whose = [], [], []
    for number, (effect, place) in enumerate(options):
        here = nudged(setting, values, [effect])
        for name, one in place.items():
            here[index(name)] = np.clip(one, *setting.bounds[name])
        for name in switches(effect):
            points.append(here)
            towards.append(np.eye(len(values))[[index(name)]])
            whose.append((number, name))
    _, slopes = predicted_and_derivatives(problem, np.stack(points), np.stack(towards))
    columns = -problem.centred(slopes[:, 0]) / np.asarray(problem.noise)
    jacobian = at.jacobian.copy()
    found = Scanned(dataclasses.replace(at, jacobian=jacobian))
    basis, residual = without(at, fitted)
    correlation = samples_per_independent(at)
    best = {effect: score_of((effect,), at, basis, residual, setting.bounds, correlation).gain for effect, _ in options}
    for number, (effect, place) in enumerate(options):
        found.looks[effect] = found.looks.get(effect, 1) + 1
        own = [(k, name) for k, (whom, name) in enumerate(whose) if whom == number]
        rows = columns[[k for k, _ in own]]
        there = Sensitivity(tuple(name for _, name in own), at.misfit, np.moveaxis(rows, 0, -1), at.mask)
        score = score_of((effect,), there, basis, residual, setting.bounds, correlation)
        if score.gain > best[effect]:
            best[effect], found.place[effect] = score.gain, place
            for k, name in own:
                jacobian[..., at.names.index(name)] = columns[k]
    return found


def scores_at(setting: Search, model: Model, left: Sequence[str]) -> list[Score]:
    """Score tests of the effects not yet in `model`, at its fit, the largest gain first; having looked at several places counts against one."""
    loose = setting.loose(model.effects, model.values)
    looked = scanned(setting, model.values, left, loose)
    scores = ranked(looked.at, loose, left, setting.bounds)
    return [
        dataclasses.replace(score, p_value=min(1.0, score.p_value * looked.looks.get(score.effects[0], 1)))
        for score in scores
    ]
