"""A kept model as the plant of closed loops, whose commands stay within those that it was fitted to."""

from __future__ import annotations

from smajax.core.display_units import digits
from smajax.core.parameters import get_parameters, set_parameters
from smajax.data.model_file.record import ModelRecord
from smajax.model.system import System

LIMIT = "amplifier_limit"


def plant_of(model: ModelRecord, system: System | None = None) -> tuple[System, str]:
    """(the model's system, or `system` made of it, with its limit of the command; a sentence on that limit, "" where it is its own).

    Where nobody gave the limit of a voltage amplifier it is a preset's, which no bench has: the largest command of the fit runs takes its
    place, since beyond it the model extrapolates. Other drives have no limit.
    """
    system = model.system if system is None else system
    name, unit = system.drive.command
    largest = _largest(model)
    if largest is None:
        return system, ""
    sentence = (
        f"The {name} is limited to {digits(largest, 4)} {unit}, the largest of the runs that the model was fitted to; give "
        f"{LIMIT} in the model file or with --set for another limit."
    )
    return within_limit(model, system), sentence


def within_limit(model: ModelRecord, system: System) -> System:
    """`system`, or a stack of systems, with the limit that `plant_of` gives the model."""
    largest = _largest(model)
    if largest is None:
        return system
    gain = get_parameters(system, ["amplifier_gain"])[0]
    return set_parameters(system, {LIMIT: gain * largest})


def _largest(model: ModelRecord) -> float | None:
    """The largest command of the fit runs, where it takes the place of the amplifier's limit."""
    name, _ = model.system.drive.command
    known = model.parameters.get(LIMIT)
    if known is None or known.origin != "preset" or name not in model.fitted_range:
        return None
    largest = max(abs(end) for end in model.fitted_range[name])
    return largest if 0.0 < model.values["amplifier_gain"] * largest < known.value else None
