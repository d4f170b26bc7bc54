"""What goes on beside the caller: compilers let Python go on meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


def begun(function: Callable[..., Any], *arguments: Any) -> Future[Any] | None:
    """What `function` gives, by a thread that ends with it; None where there is no room for another thread under a cap on memory."""
    pool = ThreadPoolExecutor(1)
    try:
        coming = pool.submit(function, *arguments)
    except RuntimeError:
        return None
    pool.shutdown(wait=False)
    return coming
