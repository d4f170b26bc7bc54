"""Progress of long work, as typed events: how far a stage is, a sentence, a warning, a compilation, an intermediate result.

Whoever does the work calls `progress(event)`; whoever shows it decides what becomes of each kind.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, TypeAlias


@dataclass(frozen=True)
class Stage:
    """A stage of the work, and which share of it is done, 0..1; a share of 1 ends the stage."""

    name: str
    share: float


@dataclass(frozen=True)
class Message:
    """A sentence about the work; shown where progress is shown."""

    text: str


@dataclass(frozen=True)
class WarningMessage:
    """What looks wrong; shown even where progress is not."""

    text: str


@dataclass(frozen=True)
class Compiling:
    """A program has been compiling for some seconds, or (`active` false) has been compiled. May come from another thread."""

    active: bool


@dataclass(frozen=True)
class Result:
    """An intermediate result, as a record; whoever shows it knows its type and puts it into words."""

    record: object


@dataclass(frozen=True)
class BestFit:
    """The best of the fits that a stage runs at once, as it is by now.

    values: free parameters by name, in `units`. errors: root mean square misfit of each series of the problem (one output of one run,
    those of the first run first), SI; nan of a run that this fit leaves out, empty where it is not known.
    """

    stage: str
    values: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    errors: tuple[float, ...] = ()


Event: TypeAlias = Stage | Message | WarningMessage | Compiling | Result | BestFit
Progress: TypeAlias = Callable[[Event], None]


def event_record(event: Event) -> dict[str, Any] | None:
    """An event as JSON values, with its kind as `event`; None of an intermediate result, which has no words here."""
    return None if isinstance(event, Result) else {"event": type(event).__name__, **asdict(event)}


def quiet(event: Event) -> None:
    """Progress that is shown to no one."""


def part_of(progress: Progress, place: int, parts: int) -> Progress:
    """`progress` of a stage that is done in equal parts, from within the part `place`, 0..parts - 1."""
    if progress is quiet:
        return quiet

    def scaled(event: Event) -> None:
        progress(replace(event, share=(place + event.share) / parts) if isinstance(event, Stage) else event)

    return scaled


def report_warnings(progress: Progress, found: Iterable[str]) -> None:
    """What looks wrong before a fit."""
    for line in found:
        progress(WarningMessage(f"check: {line}"))


def as_progress(callback: Callable[..., Any]) -> Progress:
    """`callback` as one that takes events; one of two arguments (text, share) is adapted, with a DeprecationWarning.

    Public functions that take `progress` call this, until version 0.3: before, progress was `(what, share)`, with
    "say: " or "warn: " before a sentence.
    """
    if callback is quiet or not _takes_two(callback):
        return callback
    warnings.warn(
        "progress is called with one event (smajax.core.progress: Stage, Message, WarningMessage) now, and no longer "
        "with (what, share); a callback of two arguments is not called from version 0.3 on",
        DeprecationWarning,
        stacklevel=3,
    )

    def adapted(event: Event) -> None:
        match event:
            case Stage(name, share):
                callback(name, share)
            case Message(text):
                callback(f"say: {text}", 1.0)
            case WarningMessage(text):
                callback(f"warn: {text}", 1.0)

    return adapted


def _takes_two(callback: Callable[..., Any]) -> bool:
    """Whether `callback` has to be called with two positional arguments."""
    try:
        signature = inspect.signature(callback)
    except (TypeError, ValueError):  # a built-in function has none
        return False
    needed = [
        one
        for one in signature.parameters.values()
        if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD) and one.default is one.empty
    ]
    return len(needed) == 2
