"""Whether a program is compiled at this moment, by JAX or by `smajax.engine`: a stage that stands still looks like one that hangs."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache

# What JAX records: a program that is not in memory is asked of the kept ones; it is there, read or compiled.
ASKED = "/jax/compilation_cache/compile_requests_use_cache"
DONE = "/jax/core/compile/backend_compile_duration"
PATIENCE = 2.0  # s; what takes less is a small program, or one that was kept
TOLD = "compiling, the first time only"


class _Watch:
    """Waits beside each compilation, and speaks up when it takes long."""

    def __init__(self) -> None:
        self.say: Callable[[bool], None] | None = None
        self.timer: threading.Timer | None = None
        self.own = False  # it is a program of `smajax.engine`, in which JAX may ask for small ones of its own

    def asked(self, event: str, **_: str | int) -> None:
        if event == ASKED:
            self.begun()

    def begun(self) -> None:
        if self.say is None or self.timer is not None:
            return
        self.timer = threading.Timer(PATIENCE, self.say, (True,))
        self.timer.daemon = True
        self.timer.start()

    def done(self, event: str, duration_secs: float, **_: str | int) -> None:
        if event == DONE and not self.own:
            self.ended()

    def ended(self) -> None:
        if self.timer is not None:
            self.timer.cancel()
            self.timer = None
            if self.say is not None:
                self.say(False)


@lru_cache(maxsize=1)
def _watch() -> _Watch:
    """The only one of the process: older versions of JAX let nobody go who listens."""
    from jax import monitoring

    watch = _Watch()
    monitoring.register_event_listener(watch.asked)
    monitoring.register_event_duration_secs_listener(watch.done)
    return watch


@contextmanager
def compiling() -> Iterator[None]:
    """What is done in here is to trace, translate and compile a program, which is kept."""
    watch = _watch()
    watch.begun()
    before, watch.own = watch.own, True
    try:
        yield
    finally:
        watch.own = before
        if not before:
            watch.ended()


@contextmanager
def compilations_told(say: Callable[[bool], None]) -> Iterator[None]:
    """Calls `say(True)`, from a thread of its own, of a program that is compiled for longer than `PATIENCE`; `say(False)` at its end."""
    watch = _watch()
    before, watch.say = watch.say, say
    try:
        yield
    finally:
        watch.ended()
        watch.say = before
