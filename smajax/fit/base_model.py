"""From an experiment to its base model."""

from __future__ import annotations

from smajax.core.parameters import set_parameters
from smajax.data.experiment.record import Experiment
from smajax.model.extended import extended
from smajax.model.presets import build
from smajax.model.system import System


def base_model(experiment: Experiment) -> System:
    """The preset, or the model of a file, with the experiment's known values and the starts of its unknowns.

    It has the effects of the file and those of which the experiment names a parameter (`latent_heat.enthalpy`), and no others.
    """
    system = extended(
        build(experiment.wire, experiment.load, experiment.drive, experiment.law), experiment.declared_effects
    )
    return set_parameters(system, experiment.base_values)
