"""The terminal: console, Ctrl-C, closed pipes, the browser."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import textwrap
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from smajax.core.operating_system import as_typed, is_closed_pipe, repeated_interrupts

if TYPE_CHECKING:
    from rich.console import Console

INTERRUPTED = 130
REPEAT = 1.0  # s after which an unanswered Ctrl-C is repeated
NARROWEST = 40  # columns: a narrower terminal breaks lines itself
RETRY = 0.02  # s, where it came at a moment at which no exception can be raised
CALLBACKS = ("_xla_gc_callback",)  # an exception in them is lost
IMPORTING = ("<frozen importlib._bootstrap>", "_find_and_load")  # file and function that an import statement runs
STOPPING = b"\nStopping: what runs at this moment ends first, such as a compilation.\n"


@dataclass
class _Interrupts:
    """Of this process: whether Ctrl-C came, and whether it is answered, so that none is repeated while the last words are written."""

    came: bool = False
    answered: bool = False


_INTERRUPTS = _Interrupts()


def console() -> Console:
    """The console of progress and errors, on stderr."""
    from rich.console import Console

    return Console(stderr=True)


def say(sentence: str, err: bool = False) -> None:
    """A sentence of a result, indented; on a terminal broken between words, and into a file or a pipe in one line."""
    import typer

    indented = f"  {sentence}"
    if (sys.stderr if err else sys.stdout).isatty():
        width = max(shutil.get_terminal_size().columns, NARROWEST)
        indented = textwrap.fill(
            indented, width, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
        )
    typer.echo(indented, err=err)


def browse(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser

    webbrowser.open(page.resolve().as_uri())


def command_line() -> str:
    """The command as it was typed."""
    return "smajax " + as_typed(sys.argv[1:])


def _imports(frame: FrameType | None) -> int:
    """How many imports what runs in this frame is part of."""
    found = 0
    while frame is not None:
        found += (frame.f_code.co_filename, frame.f_code.co_name) == IMPORTING
        frame = frame.f_back
    return found


@contextmanager
def answer_interrupts() -> Iterator[None]:
    """Say at once that Ctrl-C came, and repeat it until it ends the command.

    An exception in a callback of XLA during garbage collection is printed and dropped; one in an import aborts the process where
    compiled code began it. Both are waited for.
    """
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    around = _imports(sys._getframe())  # a program that is itself imported

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _INTERRUPTS.answered:
            return
        if not _INTERRUPTS.came:
            _INTERRUPTS.came = True
            with suppress(OSError):
                os.write(2, STOPPING)  # no buffer of Python's, which may be in use at this moment
        waits = (frame is not None and frame.f_code.co_name in CALLBACKS) or _imports(frame) > around
        repeat(RETRY if waits else REPEAT)
        if not waits:
            raise KeyboardInterrupt

    _INTERRUPTS.came = _INTERRUPTS.answered = False
    with repeated_interrupts(interrupt) as repeat:
        yield


@contextmanager
def interrupts_answered() -> Iterator[None]:
    """A block that Ctrl-C does not end: it came already, and is answered there."""
    before, _INTERRUPTS.answered = _INTERRUPTS.answered, True
    try:
        yield
    finally:
        _INTERRUPTS.answered = before


@contextmanager
def last_words() -> Iterator[None]:
    """Say what Ctrl-C ended where it came outside of `resumable`, such as while a file is read; typer ends the command without a word."""
    try:
        yield
    except SystemExit as ended:
        if _INTERRUPTS.came and not _INTERRUPTS.answered and ended.code == INTERRUPTED:
            _INTERRUPTS.answered = True
            sys.stderr.write(
                "Interrupted. The same command goes on from what was finished before, or starts from the beginning.\n"
            )
        raise


@contextmanager
def until_pipe_closes() -> Iterator[None]:
    """For output into a pipe such as `head`, which may close it early."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        if not is_closed_pipe(error):
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the rest of the buffer is dropped


@contextmanager
def resumable(hint: str = "", out: Path | None = None, finished: str = "") -> Iterator[None]:
    """End the command on Ctrl-C with a message; typer would end it without one.

    hint: the message where a file of the pattern `finished` is in `out`; else it says that nothing was finished.
    """
    try:
        with answer_interrupts():
            yield
    except KeyboardInterrupt:
        _INTERRUPTS.answered = True
        there = out is not None and any(out.glob(finished))
        message = hint if there else "Nothing was finished: the same command starts from the beginning."
        console().print(f"\nInterrupted. {message}", soft_wrap=True)
        # At once: an interpreter that shuts down in the middle of a compilation can crash.
        os._exit(INTERRUPTED)
