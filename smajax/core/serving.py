"""What the second process does: calls of functions by its standard input, what they return by its standard output, until the first one ends."""

from __future__ import annotations

import importlib
import os
import pickle
import struct
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

from smajax.core import operating_system

LENGTH = struct.Struct("<Q")


def written(content: bytes) -> bytes:
    """A message: its length, and what it is."""
    return LENGTH.pack(len(content)) + content


def read(pipe: IO[bytes]) -> bytes:
    """The next message. Raises EOFError where the other process has ended."""
    head = pipe.read(LENGTH.size)
    if len(head) < LENGTH.size:
        raise EOFError("the other process has ended")
    content = pipe.read(*LENGTH.unpack(head))
    if len(content) < LENGTH.unpack(head)[0]:
        raise EOFError("the other process has ended")
    return content


def serve(imports: Sequence[str]) -> None:
    """Answer calls until there are no more."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a module prints is no answer
    sys.stdout = sys.stderr
    operating_system.take_cores(1)  # the first process goes on beside
    for name in imports:
        with suppress(Exception):
            importlib.import_module(name)
    while True:
        try:
            call = read(calls)
        except EOFError:
            return
        answers.write(written(_answer(call)))
        answers.flush()


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
