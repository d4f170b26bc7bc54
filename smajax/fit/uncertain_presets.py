"""What an experiment file does not give is not known: those values, their priors, and an experiment in which they are unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from smajax.core.names import listed
from smajax.core.parameters import parameter_values, parameters
from smajax.data.experiment.record import Experiment, Prior, Unknown
from smajax.fit.base_model import base_model
from smajax.fit.preset_priors import fitted_priors, preset_bounds, preset_priors
from smajax.model.effects.prior_width import CoefficientPrior
from smajax.model.system import System

Bounds = Mapping[str, tuple[float, float]]


def values_not_given(
    experiment: Experiment, base: System, bounds: Bounds | None = None
) -> tuple[dict[str, CoefficientPrior], Bounds]:
    """Priors of the values that `base` has from its presets, or from an earlier fit, alone, and within what they may move; SI.

    `bounds` of all parameters, by default those declared. What the file, its runs or its unknowns give is not among them.
    """
    of_runs = {name for run in experiment.runs for name in run.parameters}
    given = frozenset({*experiment.parameters, *(unknown.name for unknown in experiment.unknowns), *of_runs})
    stated, table = experiment.priors.presets, parameters(base)
    priors = preset_priors(table, parameter_values(base), given, stated)
    own = preset_bounds(priors, bounds or {name: (one.low, one.high) for name, one in table.items()})
    if experiment.model_file is not None:
        # What this experiment file says of them goes before what a fit left.
        priors |= fitted_priors(experiment.model_file, given | stated.keys())
        own |= {name: one for name, one in experiment.model_file.bounds.items() if name in priors.keys() - stated}
    return priors, own


def with_uncertain_presets(experiment: Experiment) -> Experiment:
    """The same experiment, in which each of these values is an unknown with its prior."""
    base = base_model(experiment)
    table, values = parameters(base), parameter_values(base)
    priors, bounds = values_not_given(experiment, base)
    added = tuple(
        Unknown(
            name,
            table[name].unit,
            *bounds[name],
            float(values[name]),
            prior=Prior(one.base, one.sigma, one.logarithmic),
        )
        for name, one in priors.items()
    )
    if not added:
        return experiment
    said = f"the file does not give {listed(tuple(priors))}: fitted too, within what data sheets leave open."
    unknowns, warnings = (*experiment.unknowns, *added), (*experiment.warnings, said)
    return replace(experiment, unknowns=unknowns, warnings=warnings, fitted_presets=tuple(priors))
