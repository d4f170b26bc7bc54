"""Presets as a model file, from which a user makes the one of an own bench."""

from __future__ import annotations

from smajax.core.parameters import parameter_values, parameters
from smajax.data.model_catalogue import check_together
from smajax.data.model_file.actuator_model import ActuatorModel
from smajax.data.model_file.record import ModelParameter
from smajax.model.presets import build


def model_of_presets(wire: str, load: str, drive: str, law: str = "") -> ActuatorModel:
    """Every value of the three presets, as ones that nobody gave. Raises KeyError for no preset, ValueError for a wrong combination."""
    system = build(wire, load, drive, law)
    check_together(system, load, drive)
    values = parameter_values(system)
    known = {
        name: ModelParameter(values[name], "preset", entry.low, entry.high)
        for name, entry in parameters(system).items()
    }
    return ActuatorModel(
        title=f"{wire}, {load}, {drive}",
        wire=wire,
        load=load,
        drive=drive,
        law=law,
        effects=(),
        parameters=known,
    )
