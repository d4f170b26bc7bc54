"""The terminal: console, Ctrl-C, closed pipes, the browser."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from smajax.core.operating_system import as_typed, is_closed_pipe, repeated_interrupts

if TYPE_CHECKING:
    from rich.console import Console

INTERRUPTED = 130
REPEAT = 1.0  # s after which an unanswered Ctrl-C is repeated
RETRY = 0.02  # s, where it came at a moment at which no exception can be raised
CALLBACKS = ("_xla_gc_callback",)  # an exception in them is lost


def console() -> Console:
    """The console of progress and errors, on stderr."""
    from rich.console import Console

    return Console(stderr=True)


def browse(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser

    webbrowser.open(page.resolve().as_uri())


def command_line() -> str:
    """The command as it was typed."""
    return "smajax " + as_typed(sys.argv[1:])


@contextmanager
def answer_interrupts() -> Iterator[None]:
    """Repeat Ctrl-C until it ends the command: an exception in a callback of XLA during garbage collection is printed and dropped."""
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        called_back = frame is not None and frame.f_code.co_name in CALLBACKS
        repeat(RETRY if called_back else REPEAT)
        if not called_back:
            raise KeyboardInterrupt

    with repeated_interrupts(interrupt) as repeat:
        yield


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
        there = out is not None and any(out.glob(finished))
        message = hint if there else "Nothing was finished: the same command starts from the beginning."
        console().print(f"\nInterrupted. {message}", soft_wrap=True)
        # At once: an interpreter that shuts down in the middle of a compilation can crash.
        os._exit(INTERRUPTED)
