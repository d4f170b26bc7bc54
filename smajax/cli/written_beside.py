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
from smajax.core.worker_process import Call, begin_call, is_begun, is_called, taken

# Seconds after which Python lets another thread go on, a tenth of its own: the search runs machine code for milliseconds at a time, and would wait
# for as long after each.
SWITCHING = 5e-4


class Begin(Protocol):
    """Begins a page of what is known, and gives the seconds that the page before took. `apart`: by the second process, where there is one."""

    def __call__(self, known: Any, apart: bool = False) -> float: ...


@contextmanager
def written_beside(write: Callable[..., object], *arguments: Any) -> Iterator[Begin]:
    """`write(known, *arguments)`, a function of a module, beside the caller, one page after the other.

    One that was begun is written to its end, also of a search that Ctrl-C ends; one that the second process has not begun when the next one comes is not written. What
    `write` raises is raised by the next call; at the end it is not, since the page of the whole result follows.
    """
    pool = ThreadPoolExecutor(1)
    last: list[Future[float] | Call[float]] = []

    def begin(known: Any, apart: bool = False) -> float:
        try:
            took = _took(last[-1]) if last else 0.0
        except Exception:
            last.clear()  # it is raised once; a page that Ctrl-C interrupts the waiting for stays, and is written to its end
            raise
        last.clear()
        page = partial(_timed, write, known, *arguments)
        if apart:
            call = begin_call(page, _timed, write, known, *arguments, first=True)
            if is_begun(call):
                last.append(call)
                return took
        try:
            last.append(pool.submit(page))
        except RuntimeError:  # no room for another thread under a cap on memory
            took = page()
        return took

    switching = sys.getswitchinterval()
    sys.setswitchinterval(SWITCHING)
    whole_follows = False
    try:
        yield begin
        whole_follows = True
    finally:
        sys.setswitchinterval(switching)
        with interrupts_answered():
            pool.shutdown()
            for page in last:
                with suppress(Exception):
                    _took(page) if whole_follows else page.result()


def _timed(write: Callable[..., object], *arguments: Any) -> float:
    began = time.monotonic()
    write(*arguments)
    return time.monotonic() - began


def _took(page: Future[float] | Call[float]) -> float:
    """Seconds that a page took, once it is written; one that the second process has not begun is not any more."""
    if isinstance(page, Call) and not is_called(page):
        taken(page)
        return 0.0
    return page.result()
