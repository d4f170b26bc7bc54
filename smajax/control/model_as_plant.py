"""A saved model as the plant of closed loops, whose commands stay within those that it was fitted to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import jax
import numpy as np

from smajax.control.compose import with_values
from smajax.control.loop_settings import LIMIT_PARAMETER
from smajax.control.presets import CONTROLLERS
from smajax.control.run_notes import InputLagLeftOut, LimitOfFitRuns, NoiseOfModelFile
from smajax.core.parameters import get_parameters, parameter_values, parameters, set_parameters
from smajax.data.model_file.record import ModelRecord
from smajax.model.effects.input_delay import InputDelay
from smajax.model.extended import with_effects, without_input_lag
from smajax.model.system import System


def plant_of(
    model: ModelRecord, changed: Mapping[str, str | float] | None = None, limit: float | None = None
) -> tuple[System, LimitOfFitRuns | None]:
    """(the model's system with the values in `changed`; the limit of its command, None where it is its own or was given).

    Where nobody gave the limit of a voltage amplifier it is a preset's, which no bench has: `limit` takes its place, in the command's
    unit, or by default the largest command of the fit runs, since beyond it the model extrapolates. Other drives have no limit. Effects that
    shift a recorded input in time are of the logs, and left out (`input_lag_left_out`).
    """
    system = without_input_lag(with_values(model.system, changed or {}))
    if gives_limit(changed or {}):
        return system, None
    if limit is not None:
        return with_limit(system, limit), None
    largest = largest_fitted(model)
    if largest is None:
        return system, None
    return with_limit(system, largest), LimitOfFitRuns(*system.drive.command, largest)


def gives_limit(changed: Iterable[str]) -> bool:
    """Whether the limit of the command is among parameters that somebody gave."""
    return LIMIT_PARAMETER in {name.split(".")[-1] for name in changed}


def with_limit(system: System, limit: float | None) -> System:
    """`system`, or a stack of systems, with this limit of its command; as it is with none, and of a drive without a limit."""
    if limit is None or LIMIT_PARAMETER not in parameters(system):
        return system
    gain = get_parameters(system, ["amplifier_gain"])[0]
    return set_parameters(system, {LIMIT_PARAMETER: gain * limit})


def within_limit(model: ModelRecord, system: System) -> System:
    """`system`, or a stack of systems, with the limit that `plant_of` gives the model, and without what shifts a recorded input."""
    return with_limit(without_input_lag(system), largest_fitted(model))


def input_lag_left_out(model: ModelRecord | None) -> list[InputLagLeftOut]:
    """The effects of a model file that shift the recorded input in time: a loop around the model is without them."""
    if model is None:
        return []
    late = model.system.terms.input_lag
    return [InputLagLeftOut(one.effect_name, float(one.delay) if isinstance(one, InputDelay) else None) for one in late]


def largest_fitted(model: ModelRecord) -> float | None:
    """The largest command of the fit runs, where it takes the place of the amplifier's limit."""
    name, _ = model.system.drive.command
    known = model.parameters.get(LIMIT_PARAMETER)
    if known is None or known.origin != "preset" or name not in model.fitted_range:
        return None
    largest = max(abs(end) for end in model.fitted_range[name])
    return largest if 0.0 < model.values["amplifier_gain"] * largest < known.value else None


def noise_of_file(model: ModelRecord | None) -> NoiseOfModelFile | None:
    """That of a reading of the position's sensor as the model's file has it; None where it has none.

    A loop reads its sensor once a period: where a sample of the fit averages several readings, one of them has more noise.
    """
    if model is None:
        return None
    name, unit = model.system.load.reading
    own = next((one for one in model.outputs if (one.name, one.unit) == (name, unit)), None)
    if own is None or not own.noise:
        return None
    if own.reading_noise is None:
        return NoiseOfModelFile(own.noise, name, unit)
    return NoiseOfModelFile(own.reading_noise, name, unit, own.noise)


def true_plant(model: ModelRecord, changed: Mapping[str, str | float], assumed: System, controller: str) -> System:
    """The plant of a model file, with the limit of the command of the system that the controller assumes.

    Raises ValueError for one with another load or drive than that system.
    """
    return CONTROLLERS[controller].plant(_on_bench(model, changed, assumed))


def _on_bench(model: ModelRecord, changed: Mapping[str, str | float], assumed: System) -> System:
    """The model's system with the limit of the assumed one. Raises as `true_plant`."""
    plant = with_values(without_input_lag(model.system), changed)
    for part in ("load", "drive"):
        own, other = (type(getattr(one, part)).__name__ for one in (assumed, plant))
        if own != other:
            raise ValueError(
                f"the plant has the {part} {other} ({getattr(model, part)}), and the controller's model the {part} {own}: give a plant with "
                f"the same {part}, or a controller's model of {getattr(model, part)}."
            )
    limit = float(assumed.drive.largest_command())
    return plant if gives_limit(changed) else with_limit(plant, limit)


def one_plant(model: ModelRecord, assumed: System) -> dict[str, np.ndarray]:
    """The plant of a model file as a batch of one (`plants.Plants`): what it has otherwise than the assumed system, (1,) each, SI.

    Raises ValueError as `true_plant`, and for a wire with another kinetics law.
    """
    plant = _on_bench(model, {}, assumed)
    names = [one.effect_name for one in (*assumed.effects, *plant.effects)]
    plant, assumed = (with_effects(one, names) for one in (plant, assumed))
    kinds: list[Any] = [jax.tree.structure(one) for one in (plant, assumed)]
    if kinds[0] != kinds[1]:
        raise ValueError(
            f"the wire of the plant ({model.wire}) has another kinetics law than that of the controller's model: loops of many plants run one "
            "program; give a plant with the same law (--law), or use `smajax simulate --plant`."
        )
    own, values = parameter_values(assumed), parameter_values(plant)
    differ = {name: value for name, value in values.items() if value != own[name]} or dict([next(iter(own.items()))])
    return {name: np.asarray([value]) for name, value in differ.items()}
