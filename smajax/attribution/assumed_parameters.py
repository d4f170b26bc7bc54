"""What `close-loop` takes as known: parameters that neither a fit nor a log gives."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

import numpy as np

from smajax.attribution.findings import AssumedParameter
from smajax.attribution.job import Job
from smajax.core.names_of_runs import parameter_of
from smajax.core.parameters import get_parameters, parameters
from smajax.data.experiment.catalogue import WIRE_SIZES
from smajax.fit.base_model import base_model
from smajax.model.channels import REPLACED


def assumed(job: Job, presets: Collection[str] = ()) -> tuple[AssumedParameter, ...]:
    """Parameters of the base model that are not fitted and that no log gives. `presets`: those of presets that are fitted."""
    experiment, model = job.experiment, base_model(job.experiment)
    logged = {own for own, channel in REPLACED.items() if all(channel in run.inputs for run in experiment.runs)}
    unknown = {parameter_of(name) for name in job.unknowns}
    own = set.intersection(*({*run.parameters} for run in experiment.runs))  # given with each run
    known = {*unknown, *logged, *presets, *own}
    table = {name: entry for name, entry in parameters(model).items() if name not in known}
    values = np.asarray(get_parameters(model, list(table))) if table else ()
    return tuple(
        AssumedParameter(
            name,
            entry.unit,
            float(value),
            (name in WIRE_SIZES or entry.path[0] == "load") and name not in experiment.parameters,
        )
        for (name, entry), value in zip(table.items(), values, strict=True)
    )


def expansion_not_given(job: Job, fitted: Mapping[str, float] = MappingProxyType({})) -> tuple[float, float] | None:
    """Thermal expansion (martensite, austenite, 1/K) that the model has by its preset's theta_T alone, as a size: theta_T / E.

    `fitted`: values of presets that the runs have corrected. None where the experiment file gives theta_T, or fits it, or the model has none.
    """
    experiment, model = job.experiment, base_model(job.experiment)
    names = ("thermal_modulus", "young_modulus_martensite", "young_modulus_austenite")
    unknown = (parameter_of(name) for name in job.unknowns)
    own = {*experiment.parameters, *unknown, *(name for run in experiment.runs for name in run.parameters)}
    if not set(names) <= parameters(model).keys() or names[0] in own:
        return None
    held = dict(zip(names, np.asarray(get_parameters(model, names)), strict=True))
    modulus, martensite, austenite = (float(fitted.get(name, held[name])) for name in names)
    return (modulus / martensite, modulus / austenite) if modulus else None
