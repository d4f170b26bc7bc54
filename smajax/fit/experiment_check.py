"""An experiment before any fit: what was read, how far the model is off where its fits begin, and what the runs determine there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from smajax.core.progress import Progress, as_progress, quiet
from smajax.core.result_cache import ResultCache
from smajax.data.experiment.record import Experiment, Unknown
from smajax.fit.identifiability import Checks
from smajax.fit.identify_stages import Options, check_identifiability, set_up
from smajax.fit.integration import unlimited, with_integration
from smajax.fit.outputs_of_runs import predicted_at
from smajax.fit.packed_runs import simulate_batch, states_by_run
from smajax.fit.zero_of_run import with_zero
from smajax.model.channels import SHOWN
from smajax.model.load.coupon import AbstractCoupon

SEED = 0  # nothing is drawn


@dataclass(frozen=True)
class CheckedSeries:
    """One sensor in one run, (n,) each, SI; nan where a sample is missing."""

    output: str
    unit: str
    noise: float
    measured: np.ndarray
    simulated: np.ndarray  # at the initial guess; with the run's offset, where the file declares one
    offset: float | None  # that zero; None where the file declares none
    rmse: float  # nan without a sample, and where the model has no number for one


@dataclass(frozen=True)
class CheckedRun:
    """One run as the model at the initial guess simulates it."""

    name: str
    role: str
    time: np.ndarray  # (n,)
    inputs: Mapping[str, np.ndarray]
    states: Mapping[str, np.ndarray]  # temperature, martensite fraction and stress, (n,)
    series: tuple[CheckedSeries, ...]

    @property
    def has_numbers(self) -> bool:
        """Whether the model has a number for each of its samples."""
        return all(bool(np.isfinite(one).all()) for one in (*self.states.values(), *(s.simulated for s in self.series)))


@dataclass(frozen=True)
class ExperimentCheck:
    """What `check_experiment` found."""

    title: str
    source: str  # name of the experiment file
    step: float  # s, of its clock
    unknowns: Mapping[str, Unknown]  # by name
    coupon: bool  # temperature and stress, or strain, are prescribed
    noises: Mapping[str, str]  # of each output: from where its noise is known
    warnings: tuple[str, ...]  # of the file and its logs
    checks: Checks
    runs: tuple[CheckedRun, ...]

    def rmse(self, output: int = 0, role: str = "fit") -> float:
        """Of an output on the runs of a role, pooled over their samples, SI; nan without a sample, and where the model has no number for one."""
        own = [run.series[output] for run in self.runs if run.role == role]
        misfit = np.concatenate(
            [(one.measured - one.simulated)[np.isfinite(one.measured)] for one in own] or [np.zeros(0)]
        )
        return float(np.sqrt(np.mean(misfit**2))) if misfit.size else float("nan")


def check_experiment(experiment: Experiment, progress: Progress = quiet) -> ExperimentCheck:
    """What `identify` and `close_loop` would begin with; nothing is fitted.

    Raises ValueError in float32.
    """
    options = Options(0, (), False, False, 0, SEED, ResultCache(None), as_progress(progress))
    setup = set_up(experiment, options)
    checks = check_identifiability(setup, options)
    # A run that takes too many steps for a fit is shown all the same.
    problem = with_integration(setup.every_run, unlimited(setup.every_run.batch.integration))
    values = problem.start_values()
    readings = predicted_at(problem, [values])[0]
    states = states_by_run(simulate_batch(problem.system, problem.with_own_values(values)), experiment.runs, SHOWN)
    count, runs = len(experiment.outputs), []
    for number, run in enumerate(experiment.runs):
        series = []
        for k, (output, measured) in enumerate(zip(experiment.outputs, run.outputs.values(), strict=True)):
            simulated, zero, rmse = with_zero(measured, readings[number * count + k, : len(run.time)], output.offset)
            own = zero if output.offset and np.isfinite(measured).any() else None
            series.append(CheckedSeries(output.name, output.unit, output.noise_sigma, measured, simulated, own, rmse))
        runs.append(CheckedRun(run.name, run.role, run.time, run.inputs, states[run.name], tuple(series)))
    return ExperimentCheck(
        title=experiment.title,
        source=experiment.path.name,
        step=experiment.step,
        unknowns=setup.unknowns,
        coupon=isinstance(problem.system.load, AbstractCoupon),
        noises={output.name: output.noise_how for output in experiment.outputs},
        warnings=experiment.warnings,
        checks=checks,
        runs=tuple(runs),
    )
