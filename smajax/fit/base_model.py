"""From an experiment to its base model."""

from __future__ import annotations

from smajax.core.parameters import set_parameters
from smajax.data.experiment.record import RUN_STARTS, Experiment
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System


def base_model(experiment: Experiment) -> System:
    """The preset with the experiment's known values and the starts of its unknowns.

    It has the effects of which the experiment names a parameter (`latent_heat.enthalpy`), and no others.
    """
    system = extended(
        build(experiment.wire, experiment.load, experiment.drive, experiment.law), experiment.declared_effects
    )
    starts = {unknown.name: unknown.start for unknown in experiment.unknowns if unknown.name not in RUN_STARTS}
    return set_parameters(system, {**experiment.parameters, **starts})
