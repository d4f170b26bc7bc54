"""The oracle of the transfer study: a model with the true effect, fitted to the fit runs with all parameters, and its errors on other runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from smajax.attribution.close_loop import SEED, prepared
from smajax.attribution.config import AttributionConfig
from smajax.attribution.model_fits import Search, Start
from smajax.core.parameters import parameter_values
from smajax.core.progress import quiet
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Experiment
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import pack
from smajax.fit.problem import Problem
from smajax.model.effects.library import LIBRARY

SIZES = (0.2, 1.0, 3.0)  # of an effect's initial guess, both ways: where fits begin
SETTLED = 1e-3


def oracle_errors(
    experiment: Experiment, judged: Experiment, options: Sequence[tuple[str, ...]], known: Mapping[str, float]
) -> dict[str, float] | None:
    """Rms error (SI, each run's own zero taken off) on every run of `judged` by the option that fits best.

    options: sets of effects that are the truth, in the library's words. known: true values of the wire, where fits begin too. None
    where no option is a candidate of these runs.
    """
    names = tuple(dict.fromkeys(name for option in options for name in option))
    context = prepared(
        dataclasses.replace(experiment, effects_only=names), ResultCache(), quiet, SEED, AttributionConfig()
    )
    setting = context.setting
    possible = [option for option in options if set(option) <= set(setting.candidates)]
    if not possible:
        return None
    starts = [start for option in possible for start in _starts(setting, option, context.base.values, known)]
    fits, _ = setting.fit(
        starts, "the true effect", enough=setting.config.final_convergence, settled=SETTLED, presets=True
    )
    best = min(range(len(fits)), key=lambda k: np.nan_to_num(fits[k].cost, nan=np.inf))
    own, index = setting.restricted(starts[best].effects)
    system = own.system_at(jnp.asarray(fits[best].values[index]))
    batch = pack(judged.runs, judged.step, parameter_values(system), own.batch.integration)
    problem = Problem.build(system, batch, own.noise_sigma, own.offset)
    (left,) = misfits(problem, [problem.start_values()])
    mask = np.asarray(batch.mask)
    rms = np.sqrt((left**2).sum(axis=1) / mask.sum(axis=1))
    return {run.name: float(one) for run, one in zip(judged.runs, rms, strict=True)}


def _starts(setting: Search, effects: tuple[str, ...], base: np.ndarray, known: Mapping[str, float]) -> list[Start]:
    """From the base fit and from the true wire, the effect at several sizes, either way and at each place of its grid."""
    place = setting.problem.names.index
    true = np.array(base)
    for name, value in known.items():
        true[place(name)] = np.clip(value, *setting.bounds[name])
    starts = []
    for values in (base, true):
        points = [np.array(values)]
        for effect in effects:
            candidate = LIBRARY[effect].candidate
            grid = [
                dict(candidate.initial_guess),
                *({**candidate.initial_guess, **one} for one in candidate.grid(setting.extent)),
            ]
            signs = (
                (1.0, -1.0) if all(setting.bounds[f"{effect}.{one}"][0] < 0.0 for one in candidate.switches) else (1.0,)
            )
            points = [
                _with(setting, point, effect, one, sign * size)
                for point in points
                for one in grid
                for sign in signs
                for size in SIZES
            ]
        starts += [Start(effects, point) for point in points]
    return starts


def _with(setting: Search, values: np.ndarray, effect: str, guess: Mapping[str, float], size: float) -> np.ndarray:
    changed = np.array(values)
    for name, value in guess.items():
        full = f"{effect}.{name}"
        scaled = size * value if name in LIBRARY[effect].candidate.switches else value
        changed[setting.problem.names.index(full)] = np.clip(scaled, *setting.bounds[full])
    return changed
