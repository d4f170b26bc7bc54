"""The stages of `identify`: the problems, the check at the initial guess, the fit, the statistics at the fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from smajax.core.names import listed
from smajax.core.progress import Progress, Result, Stage, report_warnings
from smajax.core.result_cache import ResultCache
from smajax.core.runtime import require_float64
from smajax.core.whiteness import LAGS, WHITE, correlation_time, split_runs, whiteness_p_value
from smajax.data.experiment.record import Experiment, Run, Unknown
from smajax.fit.experiment_problem import declared_problem, free_by_name
from smajax.fit.identifiability import Checks, identifiability
from smajax.fit.integration import IntegrationError, choose_integration, described, integration_error, with_integration
from smajax.fit.levenberg_marquardt import Fit, FitSettings, levenberg_marquardt
from smajax.fit.noise import fit_with_noise
from smajax.fit.ordered_ranges import in_order
from smajax.fit.posterior import library
from smajax.fit.problem import Problem
from smajax.fit.robust import NORMAL, clipped, robust_fit, robust_variance, unweighted_misfit
from smajax.fit.sensitivity import Sensitivity, sensitivity
from smajax.fit.starts import multistart
from smajax.fit.uncertain_presets import values_not_given
from smajax.fit.uncertainty import Uncertainty, covariance_of, uncertainty
from smajax.model.system import System
from smajax.simulation.steppers import Integration

EDGE = 1e-6  # of the range: a fit within bounds comes to a bound itself


@dataclass(frozen=True)
class Options:
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
class Setup:
    """What is to be fitted: the problem of the fit runs, that of every run, and the unknowns."""

    experiment: Experiment
    fit_runs: list[Run]
    unknowns: dict[str, Unknown]
    problem: Problem
    every_run: Problem

    def integrated(self, integration: Integration) -> Setup:
        """The same with all runs integrated in that way."""
        problem, every_run = (with_integration(one, integration) for one in (self.problem, self.every_run))
        return dataclasses.replace(self, problem=problem, every_run=every_run)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.unknowns)

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        return {name: (unknown.low, unknown.high) for name, unknown in self.unknowns.items()}


@dataclass(frozen=True)
class Fitted:
    """The best fit. `problem` has the noise, `weighted` also Huber's weights where they were requested."""

    problem: Problem
    weighted: Problem
    best: Fit
    fits: list[Fit]  # from each start that was run until its end, before the noise was estimated
    noise_estimated: list[bool]  # of each output
    values: dict[str, float]  # of the unknowns
    values_of_held_out_runs: dict[str, float]


@dataclass(frozen=True)
class Statistics:
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


def set_up(experiment: Experiment, options: Options) -> Setup:
    """The problems of the experiment; raises ValueError for what cannot be fitted or was not fitted."""
    require_float64("identify")
    fit_runs = [run for run in experiment.runs if run.role == "fit"]
    unknowns = free_by_name(experiment, fit_runs)
    if options.profiled and options.robust:
        raise ValueError("a profile is that of least squares: ask for it without Huber's loss.")
    if odd := [name for name in options.profiled if name not in unknowns]:
        raise ValueError(f"no profile of {listed(odd)}: not fitted; fitted are {listed(tuple(unknowns))}.")
    if options.draws:
        if options.robust:
            raise ValueError("a posterior is that of normal noise: ask for it without Huber's loss.")
        library()  # before the work, not after it
    problem, every_run = declared_problem(experiment, fit_runs), declared_problem(experiment, experiment.runs)
    options.progress(Stage("choosing the integration", 0.0))
    setup = Setup(experiment, fit_runs, unknowns, problem, every_run)
    return setup.integrated(choose_integration(every_run, every_run.system))


def check_identifiability(setup: Setup, options: Options) -> Checks:
    """Which unknowns are identifiable at the initial guess, and what the file gives or does not give without use; reported as well.

    Correlations are not among them: how large they are is known at the fit.
    """
    values = _full_values(setup.every_run, setup.problem, setup.problem.start_values())
    at = _of_fit_runs(sensitivity(setup.every_run, values, setup.names), setup)
    not_given = values_not_given(setup.experiment, setup.problem.system)[0]
    held = tuple(name for name in not_given if name not in setup.names)  # one with a base in the file may be fitted
    declared = setup.experiment.priors
    widths_alone = held and any(one.base is None for one in declared.presets.values())
    unused = bool(declared.odds or declared.coefficients or widths_alone)
    checks = Checks(identifiability(at, setup.names, setup.bounds, correlations=False), unused, held)
    report_warnings(options.progress, setup.experiment.warnings)
    options.progress(Result(checks))
    return checks


def fit_within_tolerance(setup: Setup, options: Options) -> tuple[Setup, Fitted, IntegrationError]:
    """The best fit, refitted with a finer integration where the first left too much in an output at its end."""
    fitted = fit_unknowns(setup, options)
    error = _integration_error(setup, fitted)
    if not error.small:
        at_fit = setup.every_run.with_noise(fitted.problem.noise_sigma)
        finer = choose_integration(at_fit, _system(setup, fitted), _per_run(setup, fitted))
        if described(finer) != error.description:
            setup = setup.integrated(finer)
            fitted = fit_unknowns(setup, options, fitted.best.values)
            error = _integration_error(setup, fitted)
    return setup, fitted, error


def _system(setup: Setup, fitted: Fitted) -> System:
    return setup.problem.system_at(jnp.asarray(fitted.best.values))


def _integration_error(setup: Setup, fitted: Fitted) -> IntegrationError:
    """Of every run, at the fit."""
    at_fit = setup.every_run.with_noise(fitted.problem.noise_sigma)
    return integration_error(at_fit, _system(setup, fitted), _per_run(setup, fitted))


def _per_run(setup: Setup, fitted: Fitted) -> np.ndarray:
    """Each run's own values at the fit."""
    values = _full_values(setup.every_run, fitted.problem, fitted.best.values, fitted.values_of_held_out_runs)
    return np.asarray(setup.every_run.per_run_at(jnp.asarray(values[: len(setup.every_run.names)])))


def fit_unknowns(setup: Setup, options: Options, initial_guess: np.ndarray | None = None) -> Fitted:
    """From many starts, or one; then with the noise of the outputs estimated, then by Huber's loss where requested."""
    problem, names, experiment = setup.problem, setup.names, setup.experiment
    if initial_guess is None:
        fits = multistart(problem, names, setup.bounds, options.seed, options.starts, options.fit("fitting"))
    else:
        task = problem.task(names, setup.bounds, initial_guess)
        fits = levenberg_marquardt(problem, [task], options.fit("fitting with a finer integration"))

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
    # The last fits may have left the order that those of many starts were given.
    task = weighted.task(names, setup.bounds, best.values)
    (best,) = in_order(weighted, [task], [best], options.fit("fitting"))
    values = {name: float(best.values[problem.names.index(name)]) for name in names}
    own = _values_of_held_out_runs(setup, problem, best.values, options)
    return Fitted(problem, weighted, best, fits, estimated, values, own)


def statistics_at(setup: Setup, fitted: Fitted, options: Options) -> Statistics:
    """Whiteness of the residual, and the covariance of the estimates."""
    robust, names = options.robust, setup.names
    every_run = setup.every_run.with_noise(fitted.problem.noise_sigma)
    values = _full_values(every_run, fitted.problem, fitted.best.values, fitted.values_of_held_out_runs)
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
    ratio = residual_size(samples, robust)
    inflation = variance or max(ratio**2, 1e-300) * independent
    correlated, covariance = covariance_of(at, names, known, variance)
    return Statistics(
        every_run=every_run,
        everywhere=everywhere,
        at=at,
        misfit=misfit,
        residual=residual,
        whiteness_p=white,
        independent=independent,
        ratio=ratio,
        inflation=inflation,
        uncertainty=known,
        correlated=correlated,
        covariance=covariance,
    )


def _full_values(
    every_run: Problem, problem: Problem, values: np.ndarray, own: Mapping[str, float] = MappingProxyType({})
) -> np.ndarray:
    """Parameters of the problem of every run from those of the fit runs; of single held-out runs the start, or `own`."""
    start = dict(zip(every_run.names, every_run.start_values().tolist(), strict=True))
    known = {**start, **dict(zip(problem.names, values.tolist(), strict=True)), **own}
    return np.asarray([*(known[name] for name in every_run.names), 0.0])


def _of_fit_runs(everywhere: Sensitivity, setup: Setup) -> Sensitivity:
    """The part of the fit runs: one compiled program, that of every run, serves the fit and the pictures."""
    experiment, count = setup.experiment, len(setup.experiment.outputs)
    series = [
        number * count + k for number, run in enumerate(experiment.runs) if run.role == "fit" for k in range(count)
    ]
    return everywhere.of_series(series, setup.problem.batch.output.shape[1])


def residual_size(misfit: np.ndarray, robust: bool) -> float:
    """Of a residual over the noise."""
    return NORMAL * float(np.median(np.abs(misfit))) if robust else float(np.sqrt(np.mean(misfit**2)))


def _values_of_held_out_runs(setup: Setup, problem: Problem, values: np.ndarray, options: Options) -> dict[str, float]:
    """Values of single held-out runs: no other run determines them, so they are fitted to these, all others fixed."""
    experiment, bounds = setup.experiment, setup.bounds
    runs = [run for run in experiment.runs if run.role != "fit"]
    if not runs or not problem.per_run.names:
        return {}
    held_out = with_integration(
        declared_problem(experiment, runs).with_noise(problem.noise_sigma), problem.batch.integration
    )
    start = held_out.start_values()
    start[: len(held_out.shared)] = values[: len(held_out.shared)]
    free = held_out.per_run.full_names
    boxes = {name: bounds[problem.per_run.of_first_run(name)] for name in free}
    settings = options.fit("fitting the values of held-out runs")
    fit = levenberg_marquardt(held_out, [held_out.task(free, boxes, start)], settings)[0]
    return {name: float(fit.values[held_out.names.index(name)]) for name in free}
