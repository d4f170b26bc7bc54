"""Priors that the experiment file gives, in the place of the library's."""

from __future__ import annotations

import math

from smajax.data.experiment.record import DeclaredPriors, Experiment, PriorSpread
from smajax.fit.experiment_problem import free_by_name
from smajax.model.effects.prior_width import CoefficientPrior

NONE_DECLARED = DeclaredPriors()


def of_unknowns(experiment: Experiment) -> dict[str, CoefficientPrior]:
    """Of the unknowns that have a prior, those with one value for each fit run as `name[run]`."""
    runs = [run for run in experiment.runs if run.role == "fit"]
    return {
        name: CoefficientPrior(one.prior.mean, one.prior.sigma, one.prior.logarithmic)
        for name, one in free_by_name(experiment, runs).items()
        if one.prior is not None
    }


def overridden(own: CoefficientPrior, declared: PriorSpread | None, bounds: tuple[float, float]) -> CoefficientPrior:
    """The prior of a coefficient with what is `declared` of it; no wider than half of its `bounds`, as the library's."""
    if declared is None:
        return own
    low, high = bounds
    base = own.base if declared.base is None else min(max(declared.base, low), high)
    if declared.sigma is None:
        return CoefficientPrior(base, own.sigma, own.logarithmic)
    if declared.logarithmic:
        widest = 0.5 * math.log(high / low) if low > 0.0 else math.inf
        return CoefficientPrior(base, min(declared.sigma, widest), True)
    return CoefficientPrior(base, min(declared.sigma, 0.5 * (high - low)), False)
