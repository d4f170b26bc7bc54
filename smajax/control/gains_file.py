"""A file of gains: what tuning writes, and what `smajax sweep --gains` reads back.

    {"format": "smajax gains 1", "controller": "pid",
     "gains": {"proportional_gain": {"value": 12.8, "unit": "V/rad"}, ...},
     "fixed": {"largest_voltage": {"value": 10.0, "unit": "V"}, "rate_filter": {"value": 0.02, "unit": "s"}, ...},
     "loop": {"command_limit": {"value": 10.0, "unit": "V"}, "period": {"value": 0.01, "unit": "s"}, ...}}

A plain number in the place of value and unit will do; values are SI. `fixed` are the controller's parameters that were not tuned, `loop` is what the gains were
tuned with (`LoopSettings`). Files of before have neither: then both are those of the plant and of whoever runs the loop. What else is
in the file says where it comes from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from dataclasses import replace as replaced
from pathlib import Path
from typing import Any

from smajax.control.controllers.base import AbstractController, limits_of
from smajax.control.loop_settings import NOT_KNOWN, LoopSettings, is_number, read_settings
from smajax.control.presets import CONTROLLERS, check_controller
from smajax.control.scales import unit_on
from smajax.core.files import json_text, replace
from smajax.core.names import close_matches
from smajax.core.parameters import check_bounds, parameter_values, parameters, set_parameters
from smajax.model.system import System

FORMAT = "smajax gains 1"


class GainsFileError(ValueError):
    """What is wrong with a file of gains, and what is expected."""


@dataclass(frozen=True)
class Gains:
    """Gains of a controller by the name of each, SI.

    fixed: its parameters that were not tuned, such as the limit of its command and its filter; what is not named is that of the plant
    that it is put on. loop: what the gains were tuned with.
    """

    controller: str
    values: Mapping[str, float]
    fixed: Mapping[str, float] = field(default_factory=dict)
    loop: LoopSettings = NOT_KNOWN

    def units(self, system: System) -> dict[str, str]:
        """The unit of each gain of the controller on this plant: V/rad of an arm is V/m where the position is a length."""
        table = parameters(CONTROLLERS[self.controller].make(system))
        return {name: unit_on(entry.unit, system) for name, entry in table.items()}

    def without_limit(self, system: System) -> Gains:
        """The same, whose limit of the command is that of the plant that it is put on, `system` or another one."""
        loop, limits = replaced(self.loop, command_limit=None), limits_of(CONTROLLERS[self.controller].make(system))
        return replaced(self, fixed={name: one for name, one in self.fixed.items() if name not in limits}, loop=loop)

    def put(self, system: System) -> AbstractController:
        """The controller's preset on `system`, the plant that it believes in, with these gains.

        Raises ValueError for a gain that it has not, or one out of its bounds.
        """
        tuned = set_parameters(CONTROLLERS[self.controller].make(system), {**self.fixed, **self.values})
        check_bounds(tuned)
        return tuned


def fixed_parameters(controller: str, made: AbstractController) -> dict[str, float]:
    """The parameters that tuning leaves as they are, SI, without those that are of the plant. made: the controller on its plant."""
    preset, values = CONTROLLERS[controller], parameter_values(made)
    return {
        name: values[name]
        for name, entry in parameters(made).items()
        if name not in preset.box and not {name, str(entry.path[0])} & preset.known
    }


def write_gains(path: Path, gains: Gains, units: Mapping[str, str], more: Mapping[str, Any]) -> Path:
    """Write the file in one step. units: of every gain and fixed parameter; `more` says where the gains come from."""

    def with_units(values: Mapping[str, float]) -> dict[str, Any]:
        return {name: {"value": value, "unit": units[name]} for name, value in values.items()}

    whole = {"format": FORMAT, "controller": gains.controller, "gains": with_units(gains.values)}
    whole |= {"fixed": with_units(gains.fixed)} if gains.fixed else {}
    whole |= {"loop": gains.loop.record()} if gains.loop.record() else {}
    return replace(path, json_text({**whole, "from": dict(more)}))


def read_gains(path: Path, system: System) -> Gains:
    """What `write_gains` wrote, or a person.

    Raises GainsFileError when the file cannot be read, or does not hold gains of a controller there is, within their
    bounds on `system`.
    """
    where = f"gains file {path}"
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise GainsFileError(f"{where} cannot be read: {error.strerror}.") from None
    except (ValueError, RecursionError) as error:  # also of numbers too long and of brackets too deep
        raise GainsFileError(
            f'{where} is not JSON ({str(error)[:200]}); expected what `smajax tune` writes: {{"controller": "pid", "gains": {{...}}}}.'
        ) from None
    if not isinstance(held, dict) or not isinstance(held.get("gains"), dict) or "controller" not in held:
        raise GainsFileError(
            f"{where} must have `controller` and `gains`, as the gains.json that `smajax tune` writes."
        )
    if held.get("format", FORMAT) != FORMAT:
        raise GainsFileError(f"{where} has the format {held['format']!r}; this version reads {FORMAT!r}.")
    name = held["controller"]
    if not isinstance(name, str) or name not in CONTROLLERS:
        raise GainsFileError(f"{where}: no controller {name!r}{close_matches(str(name), CONTROLLERS, 'there are')}.")
    try:
        check_controller(name, system)
    except ValueError as error:
        raise GainsFileError(f"{where}: {error}") from None
    preset = CONTROLLERS[name]
    plant = preset.plant(system)
    known = Gains(name, {}).units(plant)
    try:
        gains = Gains(
            name,
            _values(name, "gain", held["gains"], known),
            _values(name, "fixed parameter", held.get("fixed", {}), known),
            read_settings(held.get("loop", {}), plant),
        )
        gains.put(plant)
    except ValueError as error:
        raise GainsFileError(f"{where}: {error}") from None
    return gains


def _values(controller: str, kind: str, held: Any, known: Mapping[str, str]) -> dict[str, float]:
    """Values by name, SI, of a table with or without units. Raises ValueError."""
    if not isinstance(held, dict):
        raise ValueError(f"`{kind.split()[0]}` must be a table of names and values, not {held!r}.")
    values = {}
    for name, entry in held.items():
        if name not in known:
            tuned = CONTROLLERS[controller].box
            raise ValueError(
                f"{controller} has no {kind} {name!r}{close_matches(name, tuned if kind == 'gain' else known, 'tuned are' if kind == 'gain' else 'there are')}."
            )
        unit = entry.get("unit", known[name]) if isinstance(entry, dict) else known[name]
        value = entry.get("value") if isinstance(entry, dict) else entry
        if not is_number(value):
            raise ValueError(f"{name} must be a number, not {value!r}.")
        if unit != known[name]:
            raise ValueError(f"{name} is given in {unit!r}; expected {known[name]!r}.")
        values[name] = float(value)
    return values
