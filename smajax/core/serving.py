"""What the second process does: calls of functions by one pipe, what they return by another, until the first process ends."""

from __future__ import annotations

import importlib
import os
import pickle
import struct
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

from smajax.core import operating_system
from smajax.core.runtime import collect_rarely

LENGTH = struct.Struct("<Q")
LOOKED_FOR = 0.05  # s between two looks for the first process, in whose folder a call may write


def written(content: bytes) -> bytes:
    """A message: its length, and what it is."""
    return LENGTH.pack(len(content)) + content


def read(pipe: IO[bytes]) -> bytes:
    """The next message. Raises EOFError where the other process has ended."""
    head = pipe.read(LENGTH.size)
    content = pipe.read(*LENGTH.unpack(head)) if len(head) == LENGTH.size else b""
    if len(head) < LENGTH.size or len(content) < LENGTH.unpack(head)[0]:
        raise EOFError("the other process has ended")
    return content


def serve(imports: Sequence[str], calls: int, answers: int, parent: int) -> None:
    """Answer calls from a pipe into another one until there are no more, or the process `parent` has ended."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    operating_system.take_cores(1)  # the first process goes on beside
    collect_rarely()
    for name in imports:
        with suppress(Exception):
            importlib.import_module(name)
    with os.fdopen(calls, "rb") as asked, os.fdopen(answers, "wb") as told:
        while True:
            try:
                call = read(asked)
            except EOFError:
                return
            told.write(written(_answer(call)))
            told.flush()


def _end_with(parent: int) -> None:
    """A call may take minutes, and nobody waits for it."""
    while os.getppid() == parent:
        time.sleep(LOOKED_FOR)
    os._exit(0)


def _answer(call: bytes) -> bytes:
    """(whether the function has returned, what it returned or why not), to be read by `pickle`."""
    try:
        settings, function, arguments = pickle.loads(call)
        _set(settings)
        return pickle.dumps((True, function(*arguments)))
    except Exception as error:
        return pickle.dumps((False, f"{type(error).__name__}: {error}"))


def _set(settings: Mapping[str, Any]) -> None:
    """JAX's settings as they are in the first process, but for where it runs."""
    import jax

    for name, value in settings.items():
        if "platform" not in name and jax.config.values.get(name, value) != value:
            with suppress(Exception):
                jax.config.update(name, value)
