"""What is to be said of a run beside its series: where the settings of a closed loop come from, and what may be wrong; as records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from smajax.control.gains_file import Gains
from smajax.control.loop_settings import OPTIONS, LoopSettings
from smajax.control.presets import CONTROLLERS
from smajax.control.scales import ARM_LIMIT, is_arm, limited_as
from smajax.model.system import System

MOST_SET_POINTS = 50  # with figures of merit; more are a ramp or a sine of a file


@dataclass(frozen=True)
class LimitOfFitRuns:
    """The command is limited to the largest of the runs that the model was fitted to."""

    command: str  # voltage, current or power
    unit: str
    largest: float


@dataclass(frozen=True)
class NoiseOfModelFile:
    """The sensor has the noise that the model's file has."""

    noise: float  # standard deviation, in `unit`
    reading: str
    unit: str  # rad or m
    of_sample: float | None = None  # of a sample of the fit, which averages several readings, or whose noise was fitted


@dataclass(frozen=True)
class PresetGains:
    """The gains are those of the controller's preset."""

    controller: str
    scaled: bool  # from the arm to another load


@dataclass(frozen=True)
class VoltagesOfLimit:
    """The voltages among the gains of the arm's presets keep their share of the largest command."""

    limit: float  # of the drive, V
    preset: float  # that the presets were searched for, V


@dataclass(frozen=True)
class GainsOfFile:
    """The gains are those of a file."""

    controller: str
    taken: LoopSettings  # what the loop takes from the file
    fixed: Mapping[str, float]  # parameters of the controller that were not tuned, SI
    older: bool  # the file says nothing of the loop
    own: LoopSettings = field(default_factory=LoopSettings)  # of the loop that runs
    largest: float | None = None  # command of the controller, in the drive's unit; None where it does not say
    compared: tuple[str, ...] = ()  # all controllers of a sweep, which run in this loop too; none of a single loop


@dataclass(frozen=True)
class InputLagLeftOut:
    """An effect of a model file that shifts the recorded input in time, which no loop has."""

    effect: str
    delay: float | None = None  # s, as fitted; None of a clock that runs slow or fast


Source: TypeAlias = LimitOfFitRuns | NoiseOfModelFile | PresetGains | VoltagesOfLimit | GainsOfFile | InputLagLeftOut


@dataclass(frozen=True)
class InputLeftOut:
    """The model was fitted to runs with their own input, which this run leaves to a parameter."""

    channel: str
    unit: str
    range: tuple[float, float]  # of the fit runs
    parameter: str
    value: float


@dataclass(frozen=True)
class NotFinite:
    """Variables with values that are not finite."""

    variables: tuple[str, ...]


@dataclass(frozen=True)
class AboveMelting:
    """The wire gets hotter than it can."""

    hottest: float  # degC


@dataclass(frozen=True)
class AboveAnnealing:
    """The wire gets hotter than it may without losing its training."""

    hottest: float  # degC


@dataclass(frozen=True)
class AboveStrength:
    """The wire is under more stress than it carries."""

    largest: float  # Pa


@dataclass(frozen=True)
class NotResolved:
    """The integration leaves more in the run than is aimed for."""

    share: float  # of a whole transformation, root mean square
    limit: float  # the same, aimed for
    how: str
    loop: bool  # closed


@dataclass(frozen=True)
class CycleLeavesStrain:
    """The wire comes back to where it began with another strain, by the rate form of the constitutive law."""

    strain: float  # at the end less at the start, without the elastic strain of another stress, -


@dataclass(frozen=True)
class EndsEarly:
    """The run ends before the time that was asked for, at its last whole step, or control period of a loop."""

    asked: float  # s
    end: float  # s
    step: float  # s


@dataclass(frozen=True)
class StraightLines:
    """The reference is a column of a file, with straight lines between its rows."""

    column: str  # FILE:COLUMN or FILE:COLUMN:UNIT


@dataclass(frozen=True)
class TooManySetPoints:
    """The reference has more set points than figures of merit are given of."""

    count: int


# A string is the text of an error that did not end the run.
Note: TypeAlias = (
    InputLeftOut
    | NotFinite
    | AboveMelting
    | AboveAnnealing
    | AboveStrength
    | NotResolved
    | CycleLeavesStrain
    | EndsEarly
    | StraightLines
    | TooManySetPoints
    | str
)


def voltages_of_limit(system: System) -> list[VoltagesOfLimit]:
    """One on an arm whose drive has another limit than the presets'; gains of a file have their own voltages."""
    limit = limited_as(system) if is_arm(system) else None
    if limit is None or math.isclose(float(limit), ARM_LIMIT, rel_tol=1e-6):
        return []
    return [VoltagesOfLimit(float(limit), ARM_LIMIT)]


def gains_of_files(
    tuned: Sequence[Gains], system: System, given: LoopSettings, own: LoopSettings, compared: Sequence[str] = ()
) -> Iterator[GainsOfFile]:
    """Of each file of gains what the loop takes from it.

    system: the plant that the controllers assume. given: by options, which go first. own: settings of the loop that runs. compared: all controllers of a sweep.
    """
    over: dict[str, Any] = {name: None for name in OPTIONS if getattr(given, name) is not None}
    for gains in tuned:
        largest = float(gains.put(CONTROLLERS[gains.controller].plant(system)).largest_command())
        # Units alone, which a loop on any plant has, say nothing of what the gains were tuned with.
        older = not gains.loop.record() and not gains.fixed
        yield GainsOfFile(
            gains.controller,
            replace(gains.loop, **over),
            gains.fixed,
            older,
            own,
            largest if math.isfinite(largest) else None,
            tuple(compared),
        )
