"""An experiment's runs as a least-squares problem: outputs with their noise, priors, and values of single runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import jax.numpy as jnp
import numpy as np

from smajax.core.names_of_runs import of_run
from smajax.core.parameters import parameter_values
from smajax.data.experiment.record import Experiment, Prior, Run, Unknown
from smajax.fit.base_model import base_model
from smajax.fit.packed_runs import pack
from smajax.fit.problem import PerRun, Problem
from smajax.model.system import System


def free_by_name(experiment: Experiment, runs: Sequence[Run]) -> dict[str, Unknown]:
    """Every unknown of these runs: `name`, or `name[run]` where it has one value for each run, those last."""
    shared = {unknown.name: unknown for unknown in experiment.unknowns if not unknown.per_run}
    per_run = {
        of_run(unknown.name, run.name): unknown
        for run in runs
        for unknown in experiment.unknowns
        if unknown.of(run.name)
    }
    return {**shared, **per_run}


def own_values(experiment: Experiment, runs: Sequence[Run]) -> PerRun:
    """The unknowns with one value for each of `runs`, at their start; of a run that has none, zero."""
    per_run = [unknown for unknown in experiment.unknowns if unknown.per_run]
    names = tuple(dict.fromkeys(unknown.name for unknown in per_run))  # several may be of different runs
    own = {(one.name, run.name): one.start for one in per_run for run in runs if one.of(run.name)}
    start = [[own.get((name, run.name), 0.0) for name in names] for run in runs]
    single = tuple(dict.fromkeys(unknown.name for unknown in per_run if unknown.runs is not None))
    whole = jnp.asarray(np.asarray(start, dtype=float).reshape(len(runs), len(names)), dtype=float)
    return PerRun(names, tuple(run.name for run in runs), whole, single)


def declared_problem(experiment: Experiment, runs: Sequence[Run]) -> Problem:
    """The base model, and `runs` as they were measured, with the priors of the unknowns."""
    free = free_by_name(experiment, runs)
    return problem_of(
        experiment, runs, base_model(experiment), {name: one.prior for name, one in free.items() if one.prior}
    )


def problem_of(
    experiment: Experiment, runs: Sequence[Run], model: System, priors: Mapping[str, Prior] = MappingProxyType({})
) -> Problem:
    """`runs` as they were measured, with the outputs of the experiment and the values of single runs, by any `model`."""
    sigmas = np.asarray([output.noise_sigma for output in experiment.outputs], dtype=float)
    return Problem.build(
        model,
        pack(runs, experiment.step, parameter_values(model)),
        sigmas if len(sigmas) > 1 else sigmas[0],
        tuple(output.offset for output in experiment.outputs),
        own_values(experiment, runs),
        priors,
    )
