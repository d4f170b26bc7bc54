"""Measured runs -> parameters with error bars: fit from many starts, what the runs tell, and what they do not."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy import stats

from smajax.core.names import listed
from smajax.core.progress import Progress, as_progress, quiet, report_checks
from smajax.core.provenance import made_with
from smajax.core.result_cache import Kept
from smajax.core.whiteness import LAGS, WHITE, correlation_time, split_runs, whiteness_p_value
from smajax.data.experiment.record import Experiment
from smajax.fit.design import suggestions
from smajax.fit.directions import directions, weak_ones
from smajax.fit.experiment_problem import declared_problem, free_by_name
from smajax.fit.identify_result import Estimate, Identified, IdentifiedOutput, IdentifiedRun, IdentifiedSeries
from smajax.fit.levenberg_marquardt import Fit, fit_in_box
from smajax.fit.noise import fit_with_noise
from smajax.fit.posterior import library, posterior
from smajax.fit.problem import Problem
from smajax.fit.profile import ALIKE, profiles
from smajax.fit.robust import NORMAL, bent, robust_fit, robust_variance, unweighted_misfit
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.starts import TRIED, from_many_starts
from smajax.fit.uncertainty import covariance_of, held, identifiability, uncertainty

SEED = 2004
LEAST_FOR_SHAPE = 8  # samples, for D'Agostino's test
EDGE = 1e-6  # of the box: a fit in a box comes to a bound itself


def _stopped(best: Fit, fits: Sequence[Fit], inflation: float) -> str:
    """Why the fit ended, and how many starts came to the same."""
    same = sum(one.cost - fits[0].cost <= ALIKE * inflation for one in fits)
    return (
        f"The fit stopped after {best.steps} steps: {best.reason}. {same} of the {len(fits)} fits carried to their end "
        f"found the same least cost{'' if same == len(fits) else ', the others a higher one'}."
    )


def _whitened(runs: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Samples so far apart that they are nearly independent, over their own spread."""
    apart = max(1, round(step))
    return np.concatenate([(run[::apart] - run.mean()) / (run.std() or 1.0) for run in runs])


def _normality(samples: np.ndarray) -> float:
    """The chance of such skewness and kurtosis in normal samples (n,); nan of too few, which tell nothing of it."""
    return float(stats.normaltest(samples).pvalue) if samples.size >= LEAST_FOR_SHAPE else np.nan


def identify(
    experiment: Experiment,
    *,
    starts: int = TRIED,
    profiled: Sequence[str] = (),
    robust: bool = False,
    design: bool = False,
    draws: int = 0,
    memory: Path | None = None,
    progress: Progress = quiet,
    command: str = "",
    seed: int = SEED,
) -> Identified:
    """Fit the experiment's unknowns to its fit runs and say how well each is known; held-out runs are only simulated.

    `starts`: points of the box that the fit may start from, beside the declared one. `profiled`: parameters to draw a
    profile likelihood of. `robust`: Huber's loss. `design`: rank runs that could be done next. `draws`: of the
    posterior, of each chain (extra `bayes`). `memory`: a folder for
    fits, finished or not: an identification that was interrupted goes on from there, to the same result. Raises
    ValueError when there is nothing to fit, for a profile of what is not fitted, and in float32.
    """
    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError("identify needs float64: call `jax.config.update('jax_enable_x64', True)` first.")
    progress = as_progress(progress)
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    unknowns = free_by_name(experiment, fit_runs)
    names = tuple(unknowns)
    if not names:
        raise ValueError(f"{experiment.path}: nothing is declared unknown; add a section [unknown.NAME].")
    odd = [name for name in profiled if name not in names]
    if profiled and robust:
        raise ValueError("a profile is that of least squares: ask for it without Huber's loss.")
    if odd:
        raise ValueError(f"no profile of {listed(odd)}: not fitted; fitted are {listed(names)}.")
    if draws:
        if robust:
            raise ValueError("a posterior is that of normal noise: ask for it without Huber's loss.")
        library()  # before the work, not after it
    began = clock.monotonic()
    kept = Kept(memory)
    problem, everything = declared_problem(experiment, fit_runs), declared_problem(experiment, experiment.runs)
    bounds = {name: (unknown.low, unknown.high) for name, unknown in unknowns.items()}
    start = problem.start_values()
    # Of what the runs can tell: what is told at the start already. What moves together is told at the fit, by how much.
    at_start = sensitivity(everything, _in_full(everything, problem, start), names)
    every = identifiability(_of_fit_runs(at_start, experiment, problem), names, bounds)
    can_tell = [line for line in every if "move together" not in line]
    check = [*experiment.warnings, *can_tell]
    report_checks(progress, experiment.warnings, can_tell)
    fits = from_many_starts(problem, names, bounds, seed, starts, progress, kept)

    def again(what: str) -> Callable[[Problem, np.ndarray], Fit]:
        def fit(changed: Problem, values: np.ndarray) -> Fit:
            lane = changed.lane(names, bounds, values)
            return fit_in_box(changed, [lane], kept=kept, progress=progress, what=what)[0]

        return fit

    # The noise of an only output weighs nothing against anything, unless something is known before the runs.
    weighs = len(experiment.outputs) > 1 or any(unknown.prior for unknown in unknowns.values())
    estimated = [weighs and not output.noise_given for output in experiment.outputs]
    best = fits[0]
    if any(estimated):
        refit = again("fitting with the noise as it is left")
        problem, best = fit_with_noise(problem, best, estimated, len(names), refit, robust)
    weighted = problem
    if robust:
        weighted, best = robust_fit(problem, best, again("fitting by Huber's loss"))

    index = problem.names.index
    values = {name: float(best.values[index(name)]) for name in names}
    own = _own_of_held_out(experiment, problem, best.values, bounds, kept, progress)
    everything = eqx.tree_at(lambda one: one.noise_sigma, everything, problem.noise_sigma)
    everywhere = sensitivity(everything, _in_full(everything, problem, best.values, own), names)
    at = _of_fit_runs(everywhere, experiment, problem)
    misfit = unweighted_misfit(weighted, best.values) if robust else at.misfit
    residual = split_runs(misfit, at.mask)
    judged = [bent(one) for one in residual] if robust else residual
    white = whiteness_p_value(judged, LAGS)
    independent = 1.0 if white > WHITE else correlation_time(judged)
    together = np.concatenate(residual)
    # Of a sample over the noise's: what counts of samples far off is what Huber's loss makes of them.
    variance = robust_variance(together) * independent if robust else None
    known = uncertainty(at, names, values, bounds, variance, EDGE)
    ratio = _size(together, robust)
    inflation = variance or max(ratio**2, 1e-300) * independent
    correlated, covariance = covariance_of(at, names, known, variance)
    spread = np.sqrt(np.diag(covariance)) if len(correlated) else np.ones(0)
    told = np.concatenate([at.columns(names), at.prior_columns(names)])
    seen = [name for k, name in enumerate(names) if told[:, k].any() and not held(values[name], *bounds[name], EDGE)]
    degrees = [name for name in seen if unknowns[name].unit == "degC"]
    weak = directions(at, seen, values, inflation, degrees) if seen else ()
    drawn = profiles(weighted, profiled, names, bounds, best, known.standard_error, inflation, progress, kept)
    drawn_from = None
    if draws and correlated:
        chains: dict[str, Any] = {"seed": seed, "kept": kept, "progress": progress}
        drawn_from = posterior(problem, best.values, correlated, covariance, bounds, inflation, draws, **chains)
    ideas = suggestions(weighted, best.values, correlated, fit_runs, inflation) if design else ()
    return Identified(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        outputs=_outputs(experiment, problem, estimated, misfit, at.mask, robust),
        stopped=_stopped(best, fits, inflation),
        check=tuple(check),
        estimates=tuple(
            Estimate(
                name,
                unknown.unit,
                values[name],
                known.standard_error[name],
                *bounds[name],
                float(start[index(name)]),
                unknown.prior,
                known.remark[name],
            )
            for name, unknown in unknowns.items()
        ),
        own_of_held_out=own,
        correlated=correlated,
        correlation=covariance / np.outer(spread, spread),
        weak=tuple(weak_ones(weak)),
        all_took_part=len(seen) == len(names),
        directions=weak,
        profiles=drawn,
        posterior=drawn_from,
        start_costs=tuple(one.cost / float(problem.batch.mask.sum()) for one in fits),
        ratio=ratio,
        whiteness_p=white,
        normality_p=_normality(_whitened(residual, independent)),
        independent=independent,
        robust=robust,
        runs=_runs(experiment, everywhere, np.asarray(everything.noise), correlated, covariance),
        suggestions=ideas,
        step=experiment.step,
        clocked=experiment.clocked,
        provenance=_provenance(command, seed, starts, clock.monotonic() - began, kept),
    )


def _in_full(
    everything: Problem, problem: Problem, values: np.ndarray, own: Mapping[str, float] = MappingProxyType({})
) -> np.ndarray:
    """Parameters of the problem of every run from those of the fit runs'; held-out runs' own at their start, or `own`."""
    start = dict(zip(everything.names, everything.start_values().tolist(), strict=True))
    known = {**start, **dict(zip(problem.names, values.tolist(), strict=True)), **own}
    return np.asarray([*(known[name] for name in everything.names), 0.0])


def _of_fit_runs(everywhere: Sensitivity, experiment: Experiment, problem: Problem) -> Sensitivity:
    """One program serves the fit and the pictures: that of every run. What the fit is told is its own runs'."""
    count = len(experiment.outputs)
    series = [
        number * count + k for number, run in enumerate(experiment.runs) if run.role == "fit" for k in range(count)
    ]
    return everywhere.of_series(series, problem.batch.output.shape[1])


def _size(misfit: np.ndarray, robust: bool) -> float:
    """Of a residual over the noise."""
    return NORMAL * float(np.median(np.abs(misfit))) if robust else float(np.sqrt(np.mean(misfit**2)))


def _outputs(
    experiment: Experiment,
    problem: Problem,
    estimated: Sequence[bool],
    misfit: np.ndarray,
    mask: np.ndarray,
    robust: bool,
) -> tuple[IdentifiedOutput, ...]:
    """Every sensor, with the noise that the fit took."""
    count = len(experiment.outputs)
    found = []
    for k, (output, with_fit) in enumerate(zip(experiment.outputs, estimated, strict=True)):
        sigma = float(problem.noise[k, 0])
        how = "as the fit leaves it" if with_fit else output.noise_how
        before = output.noise_sigma if with_fit else None
        ratio = _size(misfit[k::count][mask[k::count] > 0], robust)
        found.append(IdentifiedOutput(output.name, output.unit, sigma, how, before, ratio))
    return tuple(found)


def _own_of_held_out(
    experiment: Experiment,
    problem: Problem,
    values: np.ndarray,
    bounds: Mapping[str, tuple[float, float]],
    kept: Kept,
    progress: Progress,
) -> dict[str, float]:
    """What is the held-out runs' own: no other run tells it, so, as an offset is, it is found from them, all else held."""
    runs = [run for run in experiment.runs if run.role != "fit"]
    if not runs or not problem.own.names:
        return {}
    held_out = eqx.tree_at(lambda one: one.noise_sigma, declared_problem(experiment, runs), problem.noise_sigma)
    start = held_out.start_values()
    start[: len(held_out.shared)] = values[: len(held_out.shared)]
    free = held_out.own.in_full
    boxes = {name: bounds[f"{name.split('[')[0]}[{problem.own.runs[0]}]"] for name in free}
    lane = held_out.lane(free, boxes, start)
    found = fit_in_box(held_out, [lane], kept=kept, progress=progress, what="what is the held-out runs' own")[0]
    return {name: float(found.values[held_out.names.index(name)]) for name in free}


def _runs(
    experiment: Experiment, at: Sensitivity, noise: np.ndarray, names: Sequence[str], covariance: np.ndarray
) -> tuple[IdentifiedRun, ...]:
    """Every run, held-out ones included, at the fit."""
    assert at.shown is not None
    picked = [at.names.index(name) for name in names]
    count = len(experiment.outputs)
    found = []
    for number, run in enumerate(experiment.runs):
        n = len(run.time)
        series = []
        for k, (output, measured) in enumerate(zip(experiment.outputs, run.outputs.values(), strict=True)):
            row = number * count + k
            own, there = at.shown[row, :n], np.isfinite(measured)
            if output.offset and there.any():
                own = own + float(np.mean(measured[there] - own[there]))
            moved = at.jacobian[row, :n][:, picked] * noise[row]
            spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", moved, covariance, moved), 0.0))
            rmse = float(np.sqrt(np.mean((measured[there] - own[there]) ** 2))) if there.any() else np.nan
            series.append(IdentifiedSeries(output.name, measured, own, spread, rmse))
        found.append(IdentifiedRun(run.name, run.role, run.time, run.inputs, tuple(series)))
    return tuple(found)


def _provenance(command: str, seed: int, starts: int, seconds: float, kept: Kept) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "points of the box that were tried": str(starts),
        "seconds": f"{seconds:.0f}",
        **({"stages taken from an earlier run of the same": str(kept.reused)} if kept.reused else {}),
    }
