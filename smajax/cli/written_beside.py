"""Pages that are written beside the search: drawing them takes one core for seconds, and the search goes on with the other."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

from smajax.cli.terminal import interrupts_answered

Known = TypeVar("Known")
# Seconds after which Python lets another thread go on, a tenth of its own: the search runs machine code for milliseconds at a time, and would wait
# for as long after each.
SWITCHING = 5e-4


@contextmanager
def written_beside(write: Callable[[Known], object]) -> Iterator[Callable[[Known], float]]:
    """`write` by another thread, one page after the other; each call gives the seconds that the page before took.

    One that is being written at the end is written to its end, also of a search that Ctrl-C ends. What `write` raises is raised by the next call;
    at the end it is not, since the page of the whole result follows.
    """
    pool = ThreadPoolExecutor(1)
    last: list[Future[float]] = []

    def timed(known: Known) -> float:
        began = time.monotonic()
        write(known)
        return time.monotonic() - began

    def begin(known: Known) -> float:
        took = last.pop().result() if last else 0.0
        try:
            last.append(pool.submit(timed, known))
        except RuntimeError:  # no room for another thread under a cap on memory
            took = timed(known)
        return took

    switching = sys.getswitchinterval()
    sys.setswitchinterval(SWITCHING)
    try:
        yield begin
    finally:
        sys.setswitchinterval(switching)
        with interrupts_answered():
            pool.shutdown()
