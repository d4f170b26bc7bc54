"""A case as the package's own fits see it, its held-out runs beside it: what every peer starts from."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from smajax.attribution.close_loop import SEED
from smajax.attribution.model_fits import Search
from smajax.core.parameters import parameter_values, parameters
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.load import load_experiment
from smajax.data.experiment.record import Experiment
from smajax.data.model_catalogue import CATALOGUE, candidates
from smajax.fit.base_model import base_model
from smajax.fit.levenberg_marquardt import Fit
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import pack
from smajax.fit.problem import Problem
from smajax.model.extended import extended


@dataclasses.dataclass(frozen=True)
class Bench:
    """The fits of the fit runs; and the same models on the held-out runs, which no fit sees."""

    experiment: Experiment
    fits: Search
    held_out: Search

    def base(self) -> Fit:
        """The base model refitted, as the loop does."""
        return self.fits.base(self.fits.problem.start_values(), SEED)

    def errors(self, points: Sequence[np.ndarray], effects: Sequence[str] = ()) -> list[tuple[float, float]]:
        """(fit runs, held-out runs) at points (P,): rms misfit over the noise, each run's best zero off.

        `effects`: those that a point may switch on. What is not among them costs nothing to simulate.
        """
        fitted, unseen = (_errors(one, points, effects) for one in (self.fits, self.held_out))
        return list(zip(fitted, unseen, strict=True))


def _errors(setting: Search, points: Sequence[np.ndarray], effects: Sequence[str]) -> list[float]:
    problem, index = setting.restricted(effects)
    found = misfits(problem, [values[index] for values in points])
    return [setting.rmse(one) / float(setting.problem.noise_sigma) for one in found]


def opened(folder: Path) -> Bench:
    """The case in `folder`."""
    experiment = load_experiment(folder / "experiment.toml", CATALOGUE)
    base = base_model(experiment)
    names = candidates(base, experiment.effects_only, experiment.effects_excluded)
    full = extended(base, names)
    bounds = {entry.name: (entry.low, entry.high) for entry in parameters(full).values()}
    bounds |= {unknown.name: (unknown.low, unknown.high) for unknown in experiment.unknowns}

    def search(role: str) -> Search:
        runs = [run for run in experiment.runs if run.role == role]
        batch = pack(runs, experiment.step, parameter_values(full))
        problem = Problem.build(full, batch, experiment.noise_sigma, experiment.offset)
        free = tuple(unknown.name for unknown in experiment.unknowns)
        return Search(problem, free, bounds, names, ResultCache())

    return Bench(experiment, search("fit"), search("held-out"))
