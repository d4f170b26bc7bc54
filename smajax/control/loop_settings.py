"""What gains were tuned with beside the model: limit of the command, control period, delay, filter, noise and steps of the sensor."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeGuard

from smajax.control.load_equation import moving_load
from smajax.control.presets import FILTERS
from smajax.core.names import close_matches
from smajax.core.wording import and_listed
from smajax.model.system import System

PERIOD = 0.01  # s, where nobody says another
LIMIT_PARAMETER = "amplifier_limit"  # of a drive whose command has one


@dataclass(frozen=True)
class LoopSettings:
    """Each None where it is not known; command_limit in `command_unit`, noise (standard deviation) and quantum (step between two readings) in
    `position_unit`.
    """

    command_limit: float | None = None  # None too: a drive without a limit
    period: float | None = None  # s
    delay: int | None = None  # control periods until a command arrives
    estimator: str | None = None  # the filter; "": the true state
    noise: float | None = None
    quantum: float | None = None  # None too: no steps
    command_unit: str = "V"
    position_unit: str = "m"

    def record(self) -> dict[str, Any]:
        """For JSON, what is known."""
        whole: dict[str, Any] = {
            "command_limit": _with_unit(self.command_limit, self.command_unit),
            "period": _with_unit(self.period, "s"),
            "delay_periods": self.delay,
            "filter": self.estimator,
            "noise": _with_unit(self.noise, self.position_unit),
            "quantum": _with_unit(self.quantum, self.position_unit),
        }
        return {name: one for name, one in whole.items() if one is not None}


NOT_KNOWN = LoopSettings()


def _with_unit(value: float | None, unit: str) -> dict[str, Any] | None:
    return None if value is None else {"value": value, "unit": unit}


class LoopInUse(NamedTuple):
    """Of a loop that runs: as `LoopSettings`, known but for the limit, which is None where the plant's own holds."""

    command_limit: float | None = None
    period: float = PERIOD
    delay: int = 0
    estimator: str = ""


LOOP_WITHOUT_FILTER = LoopInUse()


def settings_of(system: System, loop: LoopInUse, noise: float, quantum: float = 0.0) -> LoopSettings:
    """Those of a loop on this plant, whose own limit they have. noise, quantum: rad or m."""
    limit = float(system.drive.largest_command())
    return LoopSettings(
        limit if math.isfinite(limit) else None,
        loop.period,
        loop.delay,
        loop.estimator,
        noise,
        quantum or None,
        system.drive.command[1],
        moving_load(system).reading[1],
    )


def read_settings(held: Any, system: System) -> LoopSettings:
    """What `LoopSettings.record` wrote. Raises ValueError for what it cannot have written."""
    if not isinstance(held, dict):
        raise ValueError(f"`loop` must be a table such as {{'period': {{'value': 0.01, 'unit': 's'}}}}, not {held!r}.")
    known = ("command_limit", "period", "delay_periods", "filter", "noise", "quantum")
    for name in held:
        if name not in known:
            raise ValueError(f"`loop` has no {name!r}{close_matches(str(name), known, 'there are')}.")
    command, position = system.drive.command[1], moving_load(system).reading[1]
    delay, estimator = held.get("delay_periods"), held.get("filter")
    if delay is not None and (isinstance(delay, bool) or not isinstance(delay, int) or delay < 0):
        raise ValueError(f"`loop`: delay_periods must be a whole number, 0 or more, not {delay!r}.")
    if estimator is not None and estimator != "" and estimator not in FILTERS:
        raise ValueError(f"`loop`: no filter {estimator!r}{close_matches(str(estimator), FILTERS, 'there are')}.")
    return LoopSettings(
        _number("command_limit", held.get("command_limit"), command),
        _number("period", held.get("period"), "s"),
        delay,
        estimator,
        _number("noise", held.get("noise"), position, zero=True),
        _number("quantum", held.get("quantum"), position, zero=True) or None,
        command,
        position,
    )


def is_number(value: Any) -> TypeGuard[float]:
    """A finite number, and no `true`."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _number(name: str, held: Any, unit: str, zero: bool = False) -> float | None:
    """SI. zero: whether it may be 0. Raises ValueError for no number, one that is not positive, or one in another unit."""
    if held is None:
        return None
    value, own = (held.get("value"), held.get("unit", unit)) if isinstance(held, dict) else (held, unit)
    if not is_number(value) or value < 0.0 or (value == 0.0 and not zero):
        raise ValueError(f"`loop`: {name} must be a number, {'0 or more' if zero else 'more than 0'}, not {value!r}.")
    if own != unit:
        raise ValueError(f"`loop`: {name} is given in {own!r}; expected {unit!r}.")
    return float(value)


OPTIONS = {
    "command_limit": f"--set {LIMIT_PARAMETER}",
    "period": "--period",
    "delay": "--delay",
    "estimator": "--estimator",
}


def joined(
    files: Mapping[str, LoopSettings], given: LoopSettings, otherwise: LoopInUse = LOOP_WITHOUT_FILTER
) -> LoopInUse:
    """What is given, and for the rest what the files of gains say, each by its controller; what nobody says is as in `otherwise`.

    Raises ValueError where files differ in what is not given.
    """
    chosen: dict[str, Any] = {}
    for name, option in OPTIONS.items():
        own = getattr(given, name)
        said = {controller: getattr(one, name) for controller, one in files.items() if getattr(one, name) is not None}
        if own is None and len(set(said.values())) > 1:
            each = and_listed([f"{value!r} ({controller})" for controller, value in said.items()])
            raise ValueError(f"the gains were tuned with several values of {name}, {each}: say which with {option}.")
        value = own if own is not None else next(iter(said.values()), None)
        chosen |= {} if value is None else {name: value}
    return otherwise._replace(**chosen)
