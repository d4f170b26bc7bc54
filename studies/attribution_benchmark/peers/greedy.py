"""Greedy: refit with each effect in turn and keep the one with the least held-out error, until that falls no more.

What a user does who calibrates by hand. Fits, starts and bounds are the package's own; there is no score test, nothing is
left out in turn, and nothing is asked of a fall: the least counts. The effect is chosen by the held-out runs, so the
held-out error that it reports has been chosen as well.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smajax.attribution.model_fits import Model, Start
from smajax.attribution.score_test import switches
from smajax.fit.levenberg_marquardt import Fit
from smajax.model.effects.library import LIBRARY
from studies.attribution_benchmark.peers.answer import Answer
from studies.attribution_benchmark.peers.bench import Bench
from studies.attribution_benchmark.peers.plain import fit_of

ROUNDS = 3  # effects at most: no case has more than two


@dataclass(frozen=True)
class Grown:
    """A model that was made greedily; errors are rms over the noise."""

    effects: tuple[str, ...]  # in the order in which they were added
    values: np.ndarray  # (P,)
    fit_error: float
    held_out_error: float
    tried: int  # refits of one effect each


def model_of(effects: Sequence[str], fit: Fit) -> Model:
    """A fit as a model of which nothing was left out."""
    return Model(tuple(effects), fit.values, fit.cost, np.zeros((0, 0)), float("nan"))


def starts_of(bench: Bench, model: Model, effect: str) -> list[Start]:
    """`model` with `effect` switched on to either side: no score test says which."""
    fits, found = bench.fits, []
    for side in (1.0, -1.0):
        values = fits.inside(model)
        for name, size in LIBRARY[effect].candidate.initial_guess.items():
            full = f"{effect}.{name}"
            low, high = fits.bounds[full]
            begun = side * size if full in switches(effect) else size
            if not low < begun < high and side < 0.0:
                break
            values[fits.problem.names.index(full)] = begun
        else:
            found.append(Start((*model.effects, effect), values))
    return found


def grown(bench: Bench, base: Fit, most: int = ROUNDS) -> Grown:
    """From the refitted base model on, `most` effects at most."""
    model, tried = model_of((), base), 0
    every = bench.fits.candidates  # one program then serves all refits of all rounds, and all cases of a rig
    fit_error, held_out = bench.errors([base.values], every)[0]
    for _ in range(most):
        left = [name for name in every if name not in model.effects]
        starts = [start for name in left for start in starts_of(bench, model, name)]
        if not starts:
            break
        fits, _ = bench.fits.fit(starts, "refitting every effect", hops=True)
        best: dict[str, Fit] = {}
        for start, fit in zip(starts, fits, strict=True):
            name = start.effects[-1]
            if name not in best or fit.cost < best[name].cost:
                best[name] = fit
        tried += len(best)
        errors = dict(zip(best, bench.errors([fit.values for fit in best.values()], every), strict=True))
        name = min(errors, key=lambda one: errors[one][1])
        if not errors[name][1] < held_out:
            break
        model = model_of((*model.effects, name), best[name])
        fit_error, held_out = errors[name]
    return Grown(model.effects, model.values, fit_error, held_out, tried)


def chosen(bench: Bench, base: Answer) -> Answer:
    """It says that nothing is missing where no effect lowers the held-out error."""
    began = clock.monotonic()
    found = grown(bench, fit_of(bench, base))
    free = bench.fits.free(found.effects)
    return Answer(
        "greedy",
        base.case,
        found.effects,
        tuple(dict.fromkeys(LIBRARY[name].candidate.equation for name in found.effects)),
        not found.effects,
        found.fit_error,
        found.held_out_error,
        base.seconds + clock.monotonic() - began,
        f"{found.tried} refits",
        {name: float(found.values[bench.fits.problem.names.index(name)]) for name in free},
    )
