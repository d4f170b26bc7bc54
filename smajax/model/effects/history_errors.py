"""The error of an effect that reads an entry of the wire's history which no effect keeps, in whatever equation it reads it."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from smajax.model.effects.base import AbstractEffect
from smajax.model.types import WireState
from smajax.model.wire.history import missing_entry


@contextmanager
def history_entries_named() -> Iterator[None]:
    """Raise ValueError, with the effect, the entry and what to do, in the place of the KeyError of such a read; any other error as it is."""
    try:
        yield
    except KeyError as error:
        message = _message(error, [frame for frame, _ in traceback.walk_tb(error.__traceback__)])
        if not message:
            raise
        raise ValueError(message) from error


def _message(error: KeyError, frames: list[FrameType]) -> str:
    """Nothing where the key is not an entry that an effect misses."""
    for place in reversed(range(len(frames))):
        effect = frames[place].f_locals.get("self")
        if not isinstance(effect, AbstractEffect):
            continue
        name = getattr(effect, "effect_name", type(effect).__name__)
        # The read itself may be in a function that the effect calls.
        for wire in _wires(frames[place:]):
            if _reads(frames[-1], wire) and isinstance(error.args[0], str) and error.args[0] not in wire.history:
                return f"effect `{name}`: {missing_entry(error.args[0], wire.history)}"
        return ""
    return ""


def _reads(frame: FrameType, wire: WireState) -> bool:
    """Whether the key that is not there may be one of the history: what was running reads a history, or was given this one."""
    return "history" in frame.f_code.co_names or any(one is wire.history for one in frame.f_locals.values())


def _wires(frames: list[FrameType]) -> Iterator[WireState]:
    """The states of a wire at hand there, also as `old` of what an equation hands over (`HeatState`)."""
    for frame in frames:
        for value in frame.f_locals.values():
            for one in (value, getattr(value, "old", None)):
                if isinstance(one, WireState):
                    yield one
