"""Models on runs beside those of the fit, where each run has values of its own: those of another run are fitted to it alone.

No fit run says anything of them, so that everything else is held, as `identify` does.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from smajax.attribution.model_fits import Search
from smajax.core.whiteness import split_runs
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.packed_runs import RunBatch
from smajax.fit.predicted import misfits
from smajax.fit.problem import PerRun, Problem

STAGE = "fitting the values of held-out runs"


def on_runs(
    setting: Search, effects: Sequence[str], values: Sequence[np.ndarray], batch: RunBatch, runs: Sequence[str]
) -> tuple[Problem, list[np.ndarray]]:
    """(a problem of the `runs` of `batch`, its parameters by each of `values` (P,) of models with some of `effects`)."""
    problem, index = setting.restricted(effects)
    own = problem.per_run
    if not own.names:
        return problem.with_system(problem.system, batch), [one[index] for one in values]
    start = np.tile(np.asarray(own.start)[:1], (len(runs), 1))
    per_run = PerRun(own.names, tuple(runs), jnp.asarray(start))
    bounds = {name: setting.bounds[f"{name.split('[')[0]}[{own.runs[0]}]"] for name in per_run.full_names}
    priors = {
        name: prior
        for name in per_run.full_names
        if (prior := setting.prior_records(presets=False).get(f"{name.split('[')[0]}[{own.runs[0]}]")) is not None
    }
    there = problem.with_system(problem.system, batch, per_run, priors)
    points = []
    for one in values:
        known = dict(zip(problem.names, one[index].tolist(), strict=True))
        points.append(
            np.asarray([known.get(name, at) for name, at in zip(there.names, there.start_values(), strict=True)])
        )
    free = [name for name in per_run.full_names if name not in problem.names]
    if free:
        settings = FitSettings(cache=setting.cache, progress=setting.progress, stage=STAGE)
        fits = levenberg_marquardt(there, [there.task(free, bounds, point) for point in points], settings)
        points = [fit.values for fit in fits]
    return there, points


def held_out_residuals(setting: Search, effects: Sequence[str], values: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
    """Residuals of each held-out series (n,), in noises of the first output, of parameters (P,) of models with some of `effects`."""
    assert setting.held_out is not None
    there, points = on_runs(setting, effects, values, setting.held_out, setting.held_out_runs)
    mask = np.asarray(setting.held_out.mask)
    return [split_runs(misfit, mask) for misfit in misfits(there, points)]
