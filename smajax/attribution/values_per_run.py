"""Models on runs beside those of the fit, where each run has values of its own: those of another run are fitted to it alone.

No fit run says anything of them, so that everything else is held, as `identify` does.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from smajax.attribution.model_fits import Search
from smajax.core.names_of_runs import parameter_of
from smajax.core.whiteness import split_runs
from smajax.fit.levenberg_marquardt import FitSettings, levenberg_marquardt
from smajax.fit.outputs_of_runs import misfits
from smajax.fit.packed_runs import RunBatch
from smajax.fit.problem import PerRun, Problem
from smajax.fit.sensitivity import sensitivity

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
    # What single runs have of their own is of an effect that changes nothing in the others.
    start[:, [name in own.single for name in own.names]] = 0.0
    per_run = PerRun(own.names, tuple(runs), jnp.asarray(start), own.single)
    fitted = _fitted(per_run)
    bounds = {name: setting.bounds[own.of_first_run(name)] for name in fitted}
    records = setting.prior_records(presets=False)
    priors = {name: prior for name in fitted if (prior := records.get(own.of_first_run(name))) is not None}
    there = problem.with_system(problem.system, batch, per_run, priors)
    points = []
    for one in values:
        known = dict(zip(problem.names, one[index].tolist(), strict=True))
        points.append(
            np.asarray([known.get(name, at) for name, at in zip(there.names, there.start_values(), strict=True)])
        )
    free = [name for name in fitted if name not in problem.names]
    if free:
        settings = FitSettings(cache=setting.cache, progress=setting.progress, stage=STAGE)
        fits = levenberg_marquardt(there, [there.task(free, bounds, point) for point in points], settings)
        points = [fit.values for fit in fits]
    return there, points


def _fitted(per_run: PerRun) -> list[str]:
    """The values that every run has of its own."""
    return [name for name in per_run.full_names if parameter_of(name) not in per_run.single]


def with_other_runs(
    setting: Search,
    problem: Problem,
    values: np.ndarray,
    posterior: tuple[Sequence[str], np.ndarray, np.ndarray],
    error: float,
) -> tuple[Sequence[str], np.ndarray, np.ndarray]:
    r"""A posterior (names, their sizes, covariance over these) with the own values of runs that it does not have.

    Those are fitted to their run whatever the others are, and so follow them: of the others' deviations $x$ they take $-G x$, with
    $G = M^{-1} J_o^T J / s^2$ and $M = J_o^T J_o / s^2 + \Lambda$, and have $M^{-1}$ of their own. `error`: s, of an independent sample, in the unit
    of the first output.
    """
    names, sizes, covariance = posterior
    own = [name for name in _fitted(problem.per_run) if name not in names]
    if not own:
        return posterior
    widths = []
    for name in own:
        as_fitted = setting.problem.per_run.of_first_run(name)
        at = float(values[problem.names.index(name)])
        prior = setting.of_unknowns.get(as_fitted)
        low, high = setting.bounds[as_fitted]
        widths.append(high - low if prior is None else prior.sigma * (at if prior.logarithmic else 1.0))
    jacobian = sensitivity(problem, values, [*names, *own]).jacobian
    columns = jacobian.reshape(-1, jacobian.shape[-1]) * np.concatenate([sizes, widths])
    columns = columns * float(problem.noise_sigma) / error
    shared, theirs = columns[:, : len(names)], columns[:, len(names) :]
    inverse = np.linalg.inv(theirs.T @ theirs + np.eye(len(own)))
    follows = inverse @ (theirs.T @ shared)
    crossed = -covariance @ follows.T
    whole = np.block([[covariance, crossed], [crossed.T, follows @ covariance @ follows.T + inverse]])
    return [*names, *own], np.concatenate([sizes, widths]), whole


def held_out_owners(setting: Search) -> list[int]:
    """Of which held-out run each series of `held_out_residuals` is."""
    assert setting.held_out is not None
    measured = (np.asarray(setting.held_out.mask) > 0).any(axis=1)
    return [k // len(setting.held_out.outputs) for k in np.flatnonzero(measured).tolist()]


def held_out_residuals(setting: Search, effects: Sequence[str], values: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
    """Residuals of each held-out series (n,), in noises of the first output, of parameters (P,) of models with some of `effects`."""
    assert setting.held_out is not None
    there, points = on_runs(setting, effects, values, setting.held_out, setting.held_out_runs)
    mask = np.asarray(setting.held_out.mask)
    return [split_runs(misfit, mask) for misfit in misfits(there, points)]
