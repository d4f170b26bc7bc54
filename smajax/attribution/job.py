"""What every stage of one attribution shares."""

from __future__ import annotations

from dataclasses import dataclass, replace

from smajax.attribution.run_extent import extent_of
from smajax.core.parameters import parameter_values, parameters
from smajax.data.experiment.record import Experiment, Run
from smajax.data.model_catalogue import candidates
from smajax.fit.base_model import base_model
from smajax.fit.experiment_problem import free_by_name, problem_of
from smajax.fit.integration import choose_integration, unlimited, with_integration
from smajax.fit.packed_runs import RunBatch, pack
from smajax.fit.problem import Problem
from smajax.fit.uncertain_presets import values_not_given
from smajax.model.effects.library import LIBRARY
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.extended import extended
from smajax.simulation.steppers import Integration


@dataclass(frozen=True)
class Job:
    """What every stage of one attribution shares."""

    experiment: Experiment
    fit_runs: tuple[Run, ...]
    problem: Problem
    held_out: RunBatch | None
    unknowns: tuple[str, ...]
    bounds: dict[str, tuple[float, float]]
    candidates: tuple[str, ...]
    presets: dict[str, CoefficientPrior]  # of the values that the experiment does not give
    declared: Problem  # the same runs with the effects that the experiment declares alone
    hidden_by_one_force: tuple[str, ...] = ()  # effects that runs under another load could show

    def integrated(self, given: Integration | None = None) -> Job:
        """The same with all runs integrated as `given`, or as is chosen, which takes a while."""
        integration = given or choose_integration(self.declared, self.declared.system)
        held_out = self.held_out and replace(self.held_out, integration=unlimited(integration))
        return replace(self, problem=with_integration(self.problem, integration), held_out=held_out)


def job_of(experiment: Experiment, integration: Integration | None = None) -> Job:
    """`job_by_one_step`, integrated as `integration` says, or as is chosen."""
    return job_by_one_step(experiment).integrated(integration)


def job_by_one_step(experiment: Experiment) -> Job:
    """The fit runs packed, the base model with every candidate at its base value, and the box of each parameter; by one step a sample, before an integration is chosen.

    A candidate that no fit run can show (a drift over cycles in a log of one, say) is left out here; a box that hangs on the
    runs, such as the time of a change, is taken from them.
    """
    base = base_model(experiment)
    declared = experiment.declared_effects
    names = candidates(base, experiment.effects_only, (*experiment.effects_excluded, *declared), experiment.clocked)
    known = experiment.base_values
    runs = tuple(run for run in experiment.runs if run.role == "fit")

    def problem_with(effects: tuple[str, ...]) -> Problem:
        model = extended(base, effects, {name: value for name, value in known.items() if "." in name})
        return problem_of(experiment, runs, model).in_first_noises()

    declared_problem = problem_with(declared)
    extent = extent_of(declared_problem)
    under_other_loads = tuple(
        name for name in names if LIBRARY[name].candidate.observable(extent._replace(one_force=False))
    )
    names = tuple(name for name in under_other_loads if LIBRARY[name].candidate.observable(extent))
    hidden = tuple(name for name in under_other_loads if name not in names)
    problem = problem_with((*declared, *names))
    full = problem.system
    bounds = {entry.name: (entry.low, entry.high) for entry in parameters(full).values()}
    bounds |= {f"{name}.{own}": one for name in names for own, one in LIBRARY[name].candidate.bounds(extent).items()}
    free = free_by_name(experiment, runs)
    bounds |= {name: (unknown.low, unknown.high) for name, unknown in free.items()}
    others = tuple(run for run in experiment.runs if run.role != "fit")
    held_out = pack(others, experiment.step, parameter_values(full)) if others else None
    presets, of_presets = values_not_given(experiment, base, bounds)
    bounds |= of_presets
    return Job(
        experiment=experiment,
        fit_runs=runs,
        problem=problem,
        held_out=held_out,
        unknowns=tuple(free),
        bounds=bounds,
        candidates=names,
        presets=presets,
        declared=declared_problem,
        hidden_by_one_force=hidden,
    )


def effects_excluded(experiment: Experiment) -> int:
    """How many effects that the model can show are no candidates, because [effects] of the experiment file says so."""
    every = candidates(base_model(experiment), None, experiment.declared_effects, experiment.clocked)
    only, excluded = experiment.effects_only, experiment.effects_excluded
    return sum((only is not None and name not in only) or name in excluded for name in every)
