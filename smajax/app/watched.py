"""What a running command has said so far: its events, folded into one record that a page shows."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from smajax.app.jobs import EVENTS, HIDDEN, Job

MOST_SENTENCES = 400
MOST_ERRORS = 600  # points of the curve of the errors; every second one is dropped beyond


@dataclass(frozen=True)
class Watched:
    """stage, share, since: the current stage, how far it is, and when it began (s since the epoch). latest: of the last event.

    sentences: (is a warning, text). said: what was no event, such as an error of the command. errors: (time, errors by series).
    """

    stage: str = ""
    share: float = 0.0
    since: float = 0.0
    moved: float = 0.0  # when the share was last reported
    latest: float = 0.0
    compiling: bool = False
    sentences: tuple[tuple[bool, str], ...] = ()
    said: tuple[str, ...] = ()
    parameters: Mapping[str, float] | None = None
    units: Mapping[str, str] | None = None
    errors: tuple[tuple[float, tuple[float, ...]], ...] = ()
    stages: tuple[str, ...] = ()  # that have ended

    @property
    def between(self) -> bool:
        """Whether a stage has ended and none has begun since: programs of the next one are made, which reports no share."""
        return bool(self.stage) and self.share >= 1.0

    def seconds_left(self, now: float) -> float | None:
        """Of the stage, at its pace so far, as the command line's bar has it; None before it has one."""
        if not 0.0 < self.share < 1.0 or self.moved <= self.since:
            return None
        return max((self.moved - self.since) * (1.0 - self.share) / self.share - (now - self.moved), 0.0)


def after(before: Watched, line: str) -> Watched:
    """The record with one more line of the events."""
    try:
        event = json.loads(line)
        kind, at = event["event"], float(event["at"])
    except (ValueError, TypeError, KeyError):
        return replace(before, said=(*before.said, line)[-MOST_SENTENCES:]) if line.strip() else before
    seen = replace(before, latest=at)
    match kind:
        case "Stage":
            return _staged(seen, event["name"], float(event["share"]), at)
        case "Message" | "WarningMessage":
            said = (kind == "WarningMessage", event["text"])
            return replace(seen, sentences=(*seen.sentences, said)[-MOST_SENTENCES:])
        case "Compiling":
            return replace(seen, compiling=bool(event["active"]))
        case "BestFit":
            return _fitted(seen, event, at)
    return seen


def _staged(seen: Watched, name: str, share: float, at: float) -> Watched:
    if share >= 1.0:
        ended = seen.stages if name in seen.stages[-1:] else (*seen.stages, name)
        return replace(seen, stage=name, share=1.0, moved=at, stages=ended[-MOST_SENTENCES:])
    if name != seen.stage or seen.share >= 1.0:
        return replace(seen, stage=name, share=share, since=at, moved=at)
    return replace(seen, share=share, moved=at)


def _fitted(seen: Watched, event: Mapping[str, Any], at: float) -> Watched:
    numbers = tuple(math.nan if one is None else float(one) for one in event["errors"])
    errors = seen.errors
    if numbers:
        errors = (*errors, (at, numbers))
    if len(errors) > MOST_ERRORS:
        errors = (*errors[:-1:2], errors[-1])
    return replace(seen, parameters=event["values"], units=event["units"], errors=errors)


_CACHED: dict[tuple[str, float], tuple[int, Watched]] = {}


def watched(project: Path, job: Job) -> Watched:
    """Of the last job in the folder of a project. Lines that were read are not read again, and a server that restarts reads them all."""
    path = project / HIDDEN / EVENTS
    try:
        position, seen = _CACHED.get((str(path), job.began), (0, Watched()))
        with path.open("rb") as file:
            file.seek(position)
            content = file.read()
    except OSError:
        return Watched()
    whole = content[: content.rfind(b"\n") + 1]  # the last line may be half written
    for line in whole.decode("utf-8", errors="replace").splitlines():
        seen = after(seen, line)
    if len(_CACHED) > 32:
        _CACHED.clear()
    _CACHED[str(path), job.began] = position + len(whole), seen
    return seen
