"""Measured runs -> parameters with standard errors: fits from many starts, and which parameters are identifiable."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy import stats

from smajax.core.names import listed
from smajax.core.progress import Progress, as_progress, quiet, report_checks
from smajax.core.provenance import made_with
from smajax.core.result_cache import ResultCache
from smajax.core.whiteness import LAGS, WHITE, correlation_time, split_runs, whiteness_p_value
from smajax.data.experiment.record import Experiment, Run, Unknown
from smajax.fit.design import suggestions
from smajax.fit.directions import Direction, directions, weak_combinations
from smajax.fit.experiment_problem import declared_problem, free_by_name
from smajax.fit.identify_result import Estimate, Identified, IdentifiedOutput, IdentifiedRun, IdentifiedSeries
from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.noise import fit_with_noise
from smajax.fit.posterior import ChainSettings, Posterior, library, posterior
from smajax.fit.problem import Problem
from smajax.fit.profile import EQUAL_COST, profiles
from smajax.fit.robust import NORMAL, clipped, robust_fit, robust_variance, unweighted_misfit
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.starts import SCREENED, multistart
from smajax.fit.uncertainty import Uncertainty, at_bound, covariance_of, identifiability, uncertainty

SEED = 2004
LEAST_FOR_SHAPE = 8  # samples, for D'Agostino's test
EDGE = 1e-6  # of the range: a fit within bounds comes to a bound itself


@dataclass(frozen=True)
class _Options:
    """The options of `identify`."""

    starts: int
    profiled: Sequence[str]
    robust: bool
    design: bool
    draws: int
    seed: int
    cache: ResultCache
    progress: Progress

    def fit(self, stage: str) -> FitSettings:
        return FitSettings(cache=self.cache, progress=self.progress, stage=stage)


@dataclass(frozen=True)
class _Setup:
    """What is to be fitted: the problem of the fit runs, that of every run, and the unknowns."""

    experiment: Experiment
    fit_runs: list[Run]
    unknowns: dict[str, Unknown]
    problem: Problem
    every_run: Problem

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.unknowns)

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        return {name: (unknown.low, unknown.high) for name, unknown in self.unknowns.items()}


@dataclass(frozen=True)
class _Fitted:
    """The best fit. `problem` has the noise, `weighted` also Huber's weights where they were requested."""

    problem: Problem
    weighted: Problem
    best: Fit
    fits: list[Fit]  # from each start that was run until its end, before the noise was estimated
    noise_estimated: list[bool]  # of each output
    values: dict[str, float]  # of the unknowns
    own_of_held_out: dict[str, float]


@dataclass(frozen=True)
class _Statistics:
    """Residual and uncertainty at the best fit."""

    every_run: Problem
    everywhere: Sensitivity  # of every run
    at: Sensitivity  # of the fit runs
    misfit: np.ndarray  # (series, N), over the noise
    residual: list[np.ndarray]  # the same by series, without gaps
    whiteness_p: float
    independent: float  # samples an independent one
    ratio: float
    inflation: float  # variance of an independent sample over the noise's
    uncertainty: Uncertainty
    correlated: tuple[str, ...]
    covariance: np.ndarray  # of `correlated`


def identify(  # ten parameters: the options of the command, by keyword
    experiment: Experiment,
    *,
    starts: int = SCREENED,
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

    `starts`: points within the bounds at which a fit may start, beside the declared one. `profiled`: parameters to draw a
    profile likelihood of. `robust`: Huber's loss. `design`: rank runs that could be done next. `draws`: of the
    posterior, of each chain (extra `bayes`). `memory`: a folder that caches fits, finished or not: an interrupted
    identification resumes there, with the same result. Raises ValueError when there is nothing to fit, for a profile of
    what is not fitted, and in float32.
    """
    options = _Options(starts, profiled, robust, design, draws, seed, ResultCache(memory), as_progress(progress))
    begin = clock.monotonic()
    setup = _setup(experiment, options)
    check = _check(setup, options)
    fitted = _fit(setup, options)
    statistics = _statistics(setup, fitted, options)
    names, names_with_effect, weakest = setup.names, *_directions(setup, fitted, statistics)
    drawn = profiles(
        fitted.weighted,
        profiled,
        names,
        setup.bounds,
        fitted.best,
        statistics.uncertainty.standard_error,
        statistics.inflation,
        options.fit("profiles"),
    )
    spread = np.sqrt(np.diag(statistics.covariance)) if statistics.correlated else np.ones(0)
    residual = _decorrelated(statistics.residual, statistics.independent)
    return Identified(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        outputs=_outputs(setup, fitted, statistics, robust),
        stopped=_stopped(fitted, statistics.inflation),
        check=check,
        estimates=_estimates(setup, fitted, statistics.uncertainty),
        own_of_held_out=fitted.own_of_held_out,
        correlated=statistics.correlated,
        correlation=statistics.covariance / np.outer(spread, spread),
        weak=tuple(weak_combinations(weakest)),
        all_took_part=len(names_with_effect) == len(names),
        directions=weakest,
        profiles=drawn,
        posterior=_posterior(setup, fitted, statistics, options),
        start_costs=tuple(fit.cost / float(fitted.problem.batch.mask.sum()) for fit in fitted.fits),
        ratio=statistics.ratio,
        whiteness_p=statistics.whiteness_p,
        normality_p=_normality(residual),
        independent=statistics.independent,
        robust=robust,
        runs=_runs(experiment, statistics),
        suggestions=suggestions(
            fitted.weighted, fitted.best.values, statistics.correlated, setup.fit_runs, statistics.inflation
        )
        if design
        else (),
        step=experiment.step,
        clocked=experiment.clocked,
        provenance=_provenance(command, seed, starts, clock.monotonic() - begin, options.cache),
    )


def _setup(experiment: Experiment, options: _Options) -> _Setup:
    """The problems of the experiment; raises ValueError for what cannot be fitted or was not fitted."""
    if jnp.zeros(()).dtype != jnp.float64:
        raise ValueError("identify needs float64: call `jax.config.update('jax_enable_x64', True)` first.")
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    unknowns = free_by_name(experiment, fit_runs)
    if not unknowns:
        raise ValueError(f"{experiment.path}: nothing is declared unknown; add a section [unknown.NAME].")
    if options.profiled and options.robust:
        raise ValueError("a profile is that of least squares: ask for it without Huber's loss.")
    if odd := [name for name in options.profiled if name not in unknowns]:
        raise ValueError(f"no profile of {listed(odd)}: not fitted; fitted are {listed(tuple(unknowns))}.")
    if options.draws:
        if options.robust:
            raise ValueError("a posterior is that of normal noise: ask for it without Huber's loss.")
        library()  # before the work, not after it
    problem, every_run = declared_problem(experiment, fit_runs), declared_problem(experiment, experiment.runs)
    return _Setup(experiment, fit_runs, unknowns, problem, every_run)


def _check(setup: _Setup, options: _Options) -> tuple[str, ...]:
    """Warnings of the file and which unknowns are identifiable at the initial guess; reported as well.

    Correlations are not among them: how large they are is known at the fit.
    """
    values = _full_values(setup.every_run, setup.problem, setup.problem.start_values())
    at = _of_fit_runs(sensitivity(setup.every_run, values, setup.names), setup)
    sentences = [line for line in identifiability(at, setup.names, setup.bounds) if "are correlated" not in line]
    report_checks(options.progress, setup.experiment.warnings, sentences)
    return (*setup.experiment.warnings, *sentences)


def _fit(setup: _Setup, options: _Options) -> _Fitted:
    """From many starts, then with the noise of the outputs estimated, then by Huber's loss where they are requested."""
    problem, names, experiment = setup.problem, setup.names, setup.experiment
    fits = multistart(problem, names, setup.bounds, options.seed, options.starts, options.fit("fitting"))

    def refit(stage: str) -> Callable[[Problem, np.ndarray], Fit]:
        def fit(changed: Problem, values: np.ndarray) -> Fit:
            return levenberg_marquardt(changed, [changed.task(names, setup.bounds, values)], options.fit(stage))[0]

        return fit

    # The noise of a single output does not change the fit, unless there are priors.
    weighs = len(experiment.outputs) > 1 or any(unknown.prior for unknown in setup.unknowns.values())
    estimated = [weighs and not output.noise_given for output in experiment.outputs]
    best = fits[0]
    if any(estimated):
        again = refit("fitting with the estimated noise")
        problem, best = fit_with_noise(problem, best, estimated, len(names), again, options.robust)
    weighted = problem
    if options.robust:
        weighted, best = robust_fit(problem, best, refit("fitting by Huber's loss"))
    values = {name: float(best.values[problem.names.index(name)]) for name in names}
    own = _own_of_held_out(setup, problem, best.values, options)
    return _Fitted(problem, weighted, best, fits, estimated, values, own)


def _statistics(setup: _Setup, fitted: _Fitted, options: _Options) -> _Statistics:
    """Whiteness of the residual, and the covariance of the estimates."""
    robust, names = options.robust, setup.names
    every_run = eqx.tree_at(lambda one: one.noise_sigma, setup.every_run, fitted.problem.noise_sigma)
    values = _full_values(every_run, fitted.problem, fitted.best.values, fitted.own_of_held_out)
    everywhere = sensitivity(every_run, values, names)
    at = _of_fit_runs(everywhere, setup)
    misfit = unweighted_misfit(fitted.weighted, fitted.best.values) if robust else at.misfit
    residual = split_runs(misfit, at.mask)
    tested = [clipped(series) for series in residual] if robust else residual
    white = whiteness_p_value(tested, LAGS)
    independent = 1.0 if white > WHITE else correlation_time(tested)
    samples = np.concatenate(residual)
    # Of a sample, over the noise's: Huber's loss limits the contribution of outliers.
    variance = robust_variance(samples) * independent if robust else None
    known = uncertainty(at, names, fitted.values, setup.bounds, variance, EDGE)
    ratio = _size(samples, robust)
    inflation = variance or max(ratio**2, 1e-300) * independent
    correlated, covariance = covariance_of(at, names, known, variance)
    return _Statistics(
        every_run,
        everywhere,
        at,
        misfit,
        residual,
        white,
        independent,
        ratio,
        inflation,
        known,
        correlated,
        covariance,
    )


def _directions(setup: _Setup, fitted: _Fitted, statistics: _Statistics) -> tuple[list[str], tuple[Direction, ...]]:
    """(unknowns with an effect and not at a bound, all combinations of these, the weakest first)."""
    names, values = setup.names, fitted.values
    columns = np.concatenate([statistics.at.columns(names), statistics.at.prior_columns(names)])
    picked = [
        name
        for k, name in enumerate(names)
        if columns[:, k].any() and not at_bound(values[name], *setup.bounds[name], EDGE)
    ]
    degrees = [name for name in picked if setup.unknowns[name].unit == "degC"]
    return picked, directions(statistics.at, picked, values, statistics.inflation, degrees) if picked else ()


def _posterior(setup: _Setup, fitted: _Fitted, statistics: _Statistics, options: _Options) -> Posterior | None:
    if not options.draws or not statistics.correlated:
        return None
    chains = ChainSettings(options.draws, options.seed, options.cache, options.progress)
    return posterior(
        fitted.problem,
        fitted.best.values,
        statistics.correlated,
        statistics.covariance,
        setup.bounds,
        statistics.inflation,
        chains,
    )


def _estimates(setup: _Setup, fitted: _Fitted, known: Uncertainty) -> tuple[Estimate, ...]:
    start = dict(zip(setup.problem.names, setup.problem.start_values().tolist(), strict=True))
    return tuple(
        Estimate(
            name,
            unknown.unit,
            fitted.values[name],
            known.standard_error[name],
            unknown.low,
            unknown.high,
            start[name],
            unknown.prior,
            known.remark[name],
        )
        for name, unknown in setup.unknowns.items()
    )


def _stopped(fitted: _Fitted, inflation: float) -> str:
    """Why the fit ended, and how many starts came to the same."""
    best, fits = fitted.best, fitted.fits
    same = sum(fit.cost - fits[0].cost <= EQUAL_COST * inflation for fit in fits)
    return (
        f"The fit stopped after {best.steps} steps: {best.reason}. {same} of the {len(fits)} fits run until their end "
        f"found the same least cost{'' if same == len(fits) else ', the others a higher one'}."
    )


def _decorrelated(runs: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Samples so far apart that they are nearly independent, over their standard deviation."""
    stride = max(1, round(step))
    return np.concatenate([(run[::stride] - run.mean()) / (run.std() or 1.0) for run in runs])


def _normality(samples: np.ndarray) -> float:
    """The probability of such skewness and kurtosis in normal samples (n,); NaN of too few for the test."""
    return float(stats.normaltest(samples).pvalue) if samples.size >= LEAST_FOR_SHAPE else np.nan


def _full_values(
    every_run: Problem, problem: Problem, values: np.ndarray, own: Mapping[str, float] = MappingProxyType({})
) -> np.ndarray:
    """Parameters of the problem of every run from those of the fit runs; of single held-out runs the start, or `own`."""
    start = dict(zip(every_run.names, every_run.start_values().tolist(), strict=True))
    known = {**start, **dict(zip(problem.names, values.tolist(), strict=True)), **own}
    return np.asarray([*(known[name] for name in every_run.names), 0.0])


def _of_fit_runs(everywhere: Sensitivity, setup: _Setup) -> Sensitivity:
    """The part of the fit runs: one compiled program, that of every run, serves the fit and the pictures."""
    experiment, count = setup.experiment, len(setup.experiment.outputs)
    series = [
        number * count + k for number, run in enumerate(experiment.runs) if run.role == "fit" for k in range(count)
    ]
    return everywhere.of_series(series, setup.problem.batch.output.shape[1])


def _size(misfit: np.ndarray, robust: bool) -> float:
    """Of a residual over the noise."""
    return NORMAL * float(np.median(np.abs(misfit))) if robust else float(np.sqrt(np.mean(misfit**2)))


def _outputs(setup: _Setup, fitted: _Fitted, statistics: _Statistics, robust: bool) -> tuple[IdentifiedOutput, ...]:
    """Every sensor, with the noise used in the fit."""
    outputs = setup.experiment.outputs
    count, misfit, mask = len(outputs), statistics.misfit, statistics.at.mask
    records = []
    for k, (output, with_fit) in enumerate(zip(outputs, fitted.noise_estimated, strict=True)):
        sigma = float(fitted.problem.noise[k, 0])
        how = "estimated with the fit" if with_fit else output.noise_how
        before = output.noise_sigma if with_fit else None
        ratio = _size(misfit[k::count][mask[k::count] > 0], robust)
        records.append(IdentifiedOutput(output.name, output.unit, sigma, how, before, ratio))
    return tuple(records)


def _own_of_held_out(setup: _Setup, problem: Problem, values: np.ndarray, options: _Options) -> dict[str, float]:
    """Values of single held-out runs: no other run determines them, so they are fitted to these, all others fixed."""
    experiment, bounds = setup.experiment, setup.bounds
    runs = [run for run in experiment.runs if run.role != "fit"]
    if not runs or not problem.per_run.names:
        return {}
    held_out = eqx.tree_at(lambda one: one.noise_sigma, declared_problem(experiment, runs), problem.noise_sigma)
    start = held_out.start_values()
    start[: len(held_out.shared)] = values[: len(held_out.shared)]
    free = held_out.per_run.full_names
    boxes = {name: bounds[f"{name.split('[')[0]}[{problem.per_run.runs[0]}]"] for name in free}
    settings = options.fit("fitting the values of held-out runs")
    fit = levenberg_marquardt(held_out, [held_out.task(free, boxes, start)], settings)[0]
    return {name: float(fit.values[held_out.names.index(name)]) for name in free}


def _runs(experiment: Experiment, statistics: _Statistics) -> tuple[IdentifiedRun, ...]:
    """Every run, held-out ones included, at the fit."""
    at, covariance, noise = statistics.everywhere, statistics.covariance, np.asarray(statistics.every_run.noise)
    assert at.predicted is not None
    picked = [at.names.index(name) for name in statistics.correlated]
    count = len(experiment.outputs)
    records = []
    for number, run in enumerate(experiment.runs):
        n = len(run.time)
        series = []
        for k, (output, measured) in enumerate(zip(experiment.outputs, run.outputs.values(), strict=True)):
            row = number * count + k
            simulated, valid = at.predicted[row, :n], np.isfinite(measured)
            if output.offset and valid.any():
                simulated = simulated + float(np.mean(measured[valid] - simulated[valid]))
            jacobian = at.jacobian[row, :n][:, picked] * noise[row]
            spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, covariance, jacobian), 0.0))
            rmse = float(np.sqrt(np.mean((measured[valid] - simulated[valid]) ** 2))) if valid.any() else np.nan
            series.append(IdentifiedSeries(output.name, measured, simulated, spread, rmse))
        records.append(IdentifiedRun(run.name, run.role, run.time, run.inputs, tuple(series)))
    return tuple(records)


def _provenance(command: str, seed: int, starts: int, seconds: float, cache: ResultCache) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "points screened for starts": str(starts),
        "seconds": f"{seconds:.0f}",
        **({"stages read from the cache": str(cache.reused)} if cache.reused else {}),
    }
