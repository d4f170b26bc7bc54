"""Measured runs -> parameters with error bars: fit from many starts, what the runs tell, and what they do not."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from smajax.design import Suggestion, suggestions
from smajax.experiment.record import Experiment, Run
from smajax.extended import base_model
from smajax.fit.batch import pack, simulate_batch
from smajax.fit.box import Fit, fit_in_box
from smajax.fit.directions import Direction, directions, weak_ones
from smajax.fit.problem import Problem
from smajax.fit.profile import ALIKE, Profile, profiles
from smajax.fit.progress import Progress, quiet
from smajax.fit.robust import NORMAL, robust_fit, robust_variance, unweighted_misfit
from smajax.fit.sensitivity import sensitivity
from smajax.fit.starts import TRIED, from_many_starts
from smajax.fit.uncertainty import covariance_of, held, identifiability, uncertainty
from smajax.made_with import made_with
from smajax.parameters import parameter_values, parameters
from smajax.residual.noise_like import LAGS, WHITE, correlation_time, split_runs, whiteness_p_value
from smajax.types import Trajectory

SEED = 2004
EDGE = 1e-6  # of the box: a fit in a box comes to a bound itself


@dataclass(frozen=True)
class Estimate:
    """One parameter, in the program's own unit."""

    name: str
    unit: str
    value: float
    standard_error: float | None  # None: not told by the runs
    lower: float
    upper: float
    start: float
    remark: str


@dataclass(frozen=True)
class IdentifiedRun:
    """One run as the fitted model simulates it."""

    name: str
    role: str
    time: np.ndarray  # (n,)
    inputs: dict[str, np.ndarray]
    measured: np.ndarray
    simulated: np.ndarray  # with the run's offset
    spread: np.ndarray  # standard error of the simulation that the parameters' make
    rmse: float


@dataclass(frozen=True)
class Identified:
    """What the runs told. `correlation` is that of the estimates `correlated`, (K, K)."""

    experiment: str
    title: str
    source: str
    output_name: str
    output_unit: str
    noise_sigma: float
    noise_how: str
    stopped: str
    check: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    correlated: tuple[str, ...]
    correlation: np.ndarray
    weak: tuple[str, ...]
    all_took_part: bool  # whether no parameter is left out of `weak`: held by a bound, or without any effect
    directions: tuple[Direction, ...]
    profiles: tuple[Profile, ...]
    start_costs: tuple[float, ...]  # mean square over the noise's, of every fit carried to its end
    ratio: float  # rms of the fit runs' residual over the noise
    whiteness_p: float
    normality_p: float
    independent: float  # samples an independent one
    robust: bool
    runs: tuple[IdentifiedRun, ...]
    suggestions: tuple[Suggestion, ...]
    provenance: dict[str, str]


@eqx.filter_jit
def _simulated(problem: Problem, values: jax.Array) -> Trajectory:
    return simulate_batch(problem.system_at(values), problem.batch)


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


def _problem(experiment: Experiment, runs: Sequence[Run]) -> Problem:
    model = base_model(experiment)
    batch = pack(runs, experiment.step, parameter_values(model))
    return Problem.build(model, batch, experiment.noise_sigma, experiment.offset)


def identify(
    experiment: Experiment,
    *,
    starts: int = TRIED,
    profiled: Sequence[str] = (),
    robust: bool = False,
    design: bool = False,
    progress: Progress = quiet,
    command: str = "",
    seed: int = SEED,
) -> Identified:
    """Fit the experiment's unknowns to its fit runs and say how well each is known; held-out runs are only simulated.

    `starts`: points of the box that the fit may start from, beside the declared one. `profiled`: parameters to draw a
    profile likelihood of. `robust`: Huber's loss. `design`: rank runs that could be done next. Raises ValueError when
    there is nothing to fit, for a profile of what is not fitted, and in float32.
    """
    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError("identify needs float64: call `jax.config.update('jax_enable_x64', True)` first.")
    names = tuple(unknown.name for unknown in experiment.unknowns)
    if not names:
        raise ValueError(f"{experiment.path}: nothing is declared unknown; add a section [unknown.NAME].")
    odd = [name for name in profiled if name not in names]
    if profiled and robust:
        raise ValueError("a profile is that of least squares: ask for it without Huber's loss.")
    if odd:
        raise ValueError(f"no profile of {odd}, which are not fitted; fitted are {', '.join(names)}.")
    began = clock.monotonic()
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    problem = _problem(experiment, fit_runs)
    bounds = {unknown.name: (unknown.low, unknown.high) for unknown in experiment.unknowns}
    start = problem.start_values()
    # Of what the runs can tell: what is told at the start already. What moves together is told at the fit, by how much.
    can_tell = identifiability(sensitivity(problem, start, names), names, bounds)
    check = [*experiment.warnings, *(line for line in can_tell if "move together" not in line)]
    for line in check:
        progress(f"say: check: {line}", 1.0)
    fits = from_many_starts(problem, names, bounds, seed, starts, progress)
    best, weighted = fits[0], problem
    if robust:

        def again(changed: Problem, values: np.ndarray) -> Fit:
            lane = changed.lane(names, bounds, values, len(names))
            return fit_in_box(changed, [lane], progress=progress, what="fitting by Huber's loss")[0]

        weighted, best = robust_fit(problem, best, again)

    index = problem.names.index
    values = {name: float(best.values[index(name)]) for name in names}
    at = sensitivity(problem, best.values, names)
    misfit = unweighted_misfit(weighted, best.values) if robust else at.misfit
    residual = split_runs(misfit, at.mask)
    white = whiteness_p_value(residual, LAGS)
    memory = 1.0 if white > WHITE else correlation_time(residual)
    together = np.concatenate(residual)
    # Of a sample over the noise's: what counts of samples far off is what Huber's loss makes of them.
    variance = robust_variance(together) * memory if robust else None
    ratio = NORMAL * float(np.median(np.abs(together))) if robust else float(np.sqrt(np.mean(together**2)))
    known = uncertainty(at, names, values, bounds, variance, EDGE)
    inflation = variance or max(ratio**2, 1e-300) * memory
    correlated, covariance = covariance_of(at, names, known, variance)
    spread = np.sqrt(np.diag(covariance)) if len(correlated) else np.ones(0)
    seen = [name for name in names if np.any(at.columns([name])) and not held(values[name], *bounds[name], EDGE)]
    weak = directions(at, seen, values, inflation) if seen else ()
    drawn = profiles(weighted, profiled, names, bounds, best, known.standard_error, inflation, progress)
    progress("simulating every run", 0.0)
    runs = _runs(experiment, best.values, correlated, covariance)
    progress("simulating every run", 1.0)
    ideas = suggestions(weighted, best.values, correlated, fit_runs, inflation) if design else ()
    table = parameters(problem.system)
    return Identified(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        output_name=experiment.output_name,
        output_unit=experiment.output_unit,
        noise_sigma=experiment.noise_sigma,
        noise_how=experiment.noise_how,
        stopped=_stopped(best, fits, inflation),
        check=tuple(check),
        estimates=tuple(
            Estimate(
                name,
                table[name].unit,
                values[name],
                known.standard_error[name],
                *bounds[name],
                float(start[index(name)]),
                known.remark[name],
            )
            for name in names
        ),
        correlated=correlated,
        correlation=covariance / np.outer(spread, spread),
        weak=tuple(weak_ones(weak)),
        all_took_part=len(seen) == len(names),
        directions=weak,
        profiles=drawn,
        start_costs=tuple(one.cost / float(problem.batch.mask.sum()) for one in fits),
        ratio=ratio,
        whiteness_p=white,
        normality_p=float(stats.normaltest(_whitened(residual, memory)).pvalue),
        independent=memory,
        robust=robust,
        runs=runs,
        suggestions=ideas,
        provenance=_provenance(command, seed, starts, clock.monotonic() - began),
    )


def _runs(
    experiment: Experiment, values: np.ndarray, names: Sequence[str], covariance: np.ndarray
) -> tuple[IdentifiedRun, ...]:
    """Every run, held-out ones included, simulated at the fit."""
    problem = _problem(experiment, experiment.runs)
    reading = np.asarray(_simulated(problem, jnp.asarray(values)).reading)
    moved = sensitivity(problem, values, names).jacobian * experiment.noise_sigma if names else None
    found = []
    for number, run in enumerate(experiment.runs):
        n = len(run.time)
        own = reading[number, :n]
        own = own + (float(np.mean(run.output - own)) if experiment.offset else 0.0)
        spread = np.zeros(n)
        if moved is not None:
            here = moved[number, :n]
            spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", here, covariance, here), 0.0))
        rmse = float(np.sqrt(np.mean((run.output - own) ** 2)))
        found.append(IdentifiedRun(run.name, run.role, run.time, run.inputs, run.output, own, spread, rmse))
    return tuple(found)


def _provenance(command: str, seed: int, starts: int, seconds: float) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "points of the box that were tried": str(starts),
        "seconds": f"{seconds:.0f}",
    }
