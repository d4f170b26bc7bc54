"""Measured runs -> parameters with standard errors: fits from many starts, and which parameters are identifiable."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy  # its parts are imported when they are first used

from smajax.core.blas_threads import on_one_blas_thread
from smajax.core.progress import Progress, as_progress, quiet
from smajax.core.provenance import made_with
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Experiment
from smajax.fit.design import suggestions
from smajax.fit.directions import Direction, directions
from smajax.fit.identified_model import identified_model
from smajax.fit.identify_result import Estimate, FitEnd, Identified, IdentifiedOutput, IdentifiedRun, IdentifiedSeries
from smajax.fit.identify_stages import (
    EDGE,
    Fitted,
    Options,
    Setup,
    Statistics,
    check_identifiability,
    fit_within_tolerance,
    residual_size,
    set_up,
    statistics_at,
)
from smajax.fit.posterior import ChainSettings, Posterior, posterior
from smajax.fit.profile import EQUAL_COST, profiles
from smajax.fit.starts import SCREENED
from smajax.fit.uncertainty import Uncertainty, at_bound
from smajax.fit.zero_of_run import with_zero

SEED = 2004
LEAST_FOR_SHAPE = 8  # samples, for D'Agostino's test


@on_one_blas_thread
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
    options = Options(starts, profiled, robust, design, draws, seed, ResultCache(memory), as_progress(progress))
    begin = clock.monotonic()
    setup = set_up(experiment, options)
    if not setup.unknowns:
        raise ValueError(f"{experiment.path}: nothing is declared unknown; add a section [unknown.NAME].")
    checks = check_identifiability(setup, options)
    setup, fitted, integration = fit_within_tolerance(setup, options)
    statistics = statistics_at(setup, fitted, options)
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
    runs = _runs(experiment, statistics)
    residual = _decorrelated(statistics.residual, statistics.independent)
    return Identified(
        experiment=experiment.name,
        title=experiment.title,
        source=experiment.path.name,
        outputs=_outputs(setup, fitted, statistics, robust),
        ended=_fit_end(fitted, statistics.inflation, options),
        warnings=experiment.warnings,
        checks=checks,
        estimates=_estimates(setup, fitted, statistics.uncertainty),
        values_of_held_out_runs=fitted.values_of_held_out_runs,
        correlated=statistics.correlated,
        correlation=statistics.covariance / np.outer(spread, spread),
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
        runs=runs,
        suggestions=suggestions(
            fitted.weighted, fitted.best.values, statistics.correlated, setup.fit_runs, statistics.inflation
        )
        if design
        else (),
        integration=integration,
        step=experiment.step,
        clocked=experiment.clocked,
        provenance=_provenance(command, seed, starts, clock.monotonic() - begin, options.cache),
        held_presets=checks.held_presets,
        fitted_presets=experiment.fitted_presets,
        model=identified_model(setup, fitted, statistics, runs),
    )


def _directions(setup: Setup, fitted: Fitted, statistics: Statistics) -> tuple[list[str], tuple[Direction, ...]]:
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


def _posterior(setup: Setup, fitted: Fitted, statistics: Statistics, options: Options) -> Posterior | None:
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


def _estimates(setup: Setup, fitted: Fitted, known: Uncertainty) -> tuple[Estimate, ...]:
    start = dict(zip(setup.problem.names, setup.problem.start_values().tolist(), strict=True))
    return tuple(
        Estimate(
            name=name,
            unit=unknown.unit,
            value=fitted.values[name],
            standard_error=known.standard_error[name],
            lower=unknown.low,
            upper=unknown.high,
            start=start[name],
            prior=unknown.prior,
            note=known.remarks[name],
        )
        for name, unknown in setup.unknowns.items()
    )


def _fit_end(fitted: Fitted, inflation: float, options: Options) -> FitEnd:
    best, fits, settings = fitted.best, fitted.fits, options.fit("fitting")
    same = sum(fit.cost - fits[0].cost <= EQUAL_COST * inflation for fit in fits)
    return FitEnd(best.status, best.steps, settings.max_steps, settings.tolerance, len(fits), same)


def _decorrelated(runs: Sequence[np.ndarray], step: float) -> np.ndarray:
    """Samples so far apart that they are nearly independent, over their standard deviation."""
    stride = max(1, round(step))
    return np.concatenate([(run[::stride] - run.mean()) / (run.std() or 1.0) for run in runs])


def _normality(samples: np.ndarray) -> float:
    """The probability of such skewness and kurtosis in normal samples (n,); NaN of too few for the test."""
    return float(scipy.stats.normaltest(samples).pvalue) if samples.size >= LEAST_FOR_SHAPE else np.nan


def _outputs(setup: Setup, fitted: Fitted, statistics: Statistics, robust: bool) -> tuple[IdentifiedOutput, ...]:
    """Every sensor, with the noise used in the fit."""
    outputs = setup.experiment.outputs
    count, misfit, mask = len(outputs), statistics.misfit, statistics.at.mask
    records = []
    for k, (output, with_fit) in enumerate(zip(outputs, fitted.noise_estimated, strict=True)):
        sigma = float(fitted.problem.noise[k, 0])
        how = "estimated with the fit" if with_fit else output.noise_how
        before = output.noise_sigma if with_fit else None
        ratio = residual_size(misfit[k::count][mask[k::count] > 0], robust)
        records.append(IdentifiedOutput(output.name, output.unit, sigma, how, before, ratio))
    return tuple(records)


def _runs(experiment: Experiment, statistics: Statistics) -> tuple[IdentifiedRun, ...]:
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
            simulated, _, rmse = with_zero(measured, at.predicted[row, :n], output.offset)
            jacobian = at.jacobian[row, :n][:, picked] * noise[row]
            spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, covariance, jacobian), 0.0))
            series.append(IdentifiedSeries(output.name, measured, simulated, spread, rmse))
        records.append(IdentifiedRun(run.name, run.role, run.time, run.inputs, tuple(series)))
    return tuple(records)


def _provenance(command: str, seed: int, starts: int, seconds: float, cache: ResultCache) -> dict[str, str]:
    return {
        **made_with(),
        "command": command,
        "seed": str(seed),
        "points screened for starts": str(starts),
        **cache.time_taken(seconds),
        **({"stages read from the cache": str(cache.reused)} if cache.reused else {}),
    }
