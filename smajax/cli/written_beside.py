"""Pages that are written beside the search: drawing them takes one core for seconds, and the search goes on with the other.

By a thread or, where the caller says so, by the second process: two threads of Python go on in turns, and a page written by one keeps the search for as long as it takes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, Protocol

from smajax.cli.terminal import interrupts_answered
from smajax.core.worker_process import Call, begin_call, is_called, is_there, taken

# Seconds after which Python lets another thread go on, a tenth of its own: the search runs machine code for milliseconds at a time, and would wait
# for as long after each.
SWITCHING = 5e-4


class Begin(Protocol):
    """Begins a page of what is known, and gives the seconds that the page before took. `apart`: by the second process, where there is one."""

    def __call__(self, known: Any, apart: bool = False) -> float: ...


@contextmanager
def written_beside(write: Callable[..., object], *arguments: Any) -> Iterator[Begin]:
    """`write(known, *arguments)`, a function of a module, beside the caller, one page after the other.

    One that was begun is written to its end, also of a search that Ctrl-C ends. What `write` raises is raised by the next call;
    at the end it is not, since the page of the whole result follows.
    """
    pool = ThreadPoolExecutor(1)
    last: list[Future[float] | Call[float]] = []

    def begin(known: Any, apart: bool = False) -> float:
        took = last.pop().result() if last else 0.0
        call = partial(_timed, write, known, *arguments)
        if apart and is_there():
            last.append(begin_call(call, _timed, write, known, *arguments))
            return took
        try:
            last.append(pool.submit(call))
        except RuntimeError:  # no room for another thread under a cap on memory
            took = call()
        return took

    switching = sys.getswitchinterval()
    sys.setswitchinterval(SWITCHING)
    ended = False
    try:
        yield begin
        ended = True
    finally:
        sys.setswitchinterval(switching)
        with interrupts_answered():
            pool.shutdown()
            for one in last:
                if isinstance(one, Call):
                    _end(one, ended)


def _timed(write: Callable[..., object], *arguments: Any) -> float:
    began = time.monotonic()
    write(*arguments)
    return time.monotonic() - began


def _end(page: Call[float], whole_follows: bool) -> None:
    """Wait for the second process, which may be at the page; one that it has not begun is written here, unless that of the whole result follows."""
    if whole_follows and not is_called(page):
        taken(page)  # which is to have it begun no more
        return
    with suppress(Exception):
        page.result()
