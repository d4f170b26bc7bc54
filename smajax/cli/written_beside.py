"""Pages that are written beside the search: drawing them takes one core for seconds, and the search goes on with the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

Known = TypeVar("Known")


@contextmanager
def written_beside(write: Callable[[Known], object]) -> Iterator[Callable[[Known], None]]:
    """`write` by another thread, one page after the other; at the end, also of a search that is interrupted, the last one is whole.

    What `write` raises is raised by the next call, or at the end.
    """
    last: list[Future[object]] = []

    def begin(known: Known) -> None:
        if last:
            last.pop().result()
        try:
            last.append(pool.submit(write, known))
        except RuntimeError:  # no room for another thread under a cap on memory
            write(known)

    with ThreadPoolExecutor(1) as pool:
        yield begin
        if last:
            last.pop().result()
