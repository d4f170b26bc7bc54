"""A file of gains: what tuning writes, and what `smajax sweep --gains` reads back.

    {"format": "smajax gains 1", "controller": "pid", "gains": {"proportional_gain": {"value": 12.8, "unit": "V/rad"}, ...}}

A plain number in the place of value and unit will do; values are SI. What else is in the file says where it comes from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smajax.control.controllers.base import AbstractController
from smajax.control.presets import CONTROLLERS, check_controller
from smajax.control.scales import unit_on
from smajax.core.files import json_text, replace
from smajax.core.names import close_matches
from smajax.core.parameters import check_bounds, parameters, set_parameters
from smajax.model.system import System

FORMAT = "smajax gains 1"


class GainsFileError(ValueError):
    """What is wrong with a file of gains, and what is expected."""


@dataclass(frozen=True)
class Gains:
    """Gains of a controller by the name of each, SI."""

    controller: str
    values: Mapping[str, float]

    def units(self, system: System) -> dict[str, str]:
        """The unit of each gain of the controller on this plant: V/rad of an arm is V/m where the position is a length."""
        table = parameters(CONTROLLERS[self.controller].make(system))
        return {name: unit_on(entry.unit, system) for name, entry in table.items()}

    def put(self, system: System) -> AbstractController:
        """The controller's preset on `system`, the plant that it believes in, with these gains.

        Raises ValueError for a gain that it has not, or one out of its bounds.
        """
        tuned = set_parameters(CONTROLLERS[self.controller].make(system), self.values)
        check_bounds(tuned)
        return tuned


def write_gains(path: Path, gains: Gains, units: Mapping[str, str], more: Mapping[str, Any]) -> Path:
    """Write the file in one step; `more` says where the gains come from."""
    gains_with_units = {name: {"value": value, "unit": units[name]} for name, value in gains.values.items()}
    return replace(
        path,
        json_text({"format": FORMAT, "controller": gains.controller, "gains": gains_with_units, "from": dict(more)}),
    )


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
    values = {}
    for gain, entry in held["gains"].items():
        if gain not in known:
            raise GainsFileError(f"{where}: {name} has no gain {gain!r}{close_matches(gain, preset.box, 'tuned are')}.")
        unit = entry.get("unit", known[gain]) if isinstance(entry, dict) else known[gain]
        value = entry.get("value") if isinstance(entry, dict) else entry
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise GainsFileError(f"{where}: {gain} must be a number, not {value!r}.")
        if unit != known[gain]:
            raise GainsFileError(f"{where}: {gain} is given in {unit!r}; expected {known[gain]!r}.")
        values[gain] = float(value)
    gains = Gains(name, values)
    try:
        gains.put(plant)
    except ValueError as error:
        raise GainsFileError(f"{where}: {error}") from None
    return gains
