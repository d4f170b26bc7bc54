"""Whether a program is being compiled, by JAX or by `smajax.engine`: a stage that compiles looks like one that hangs."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from smajax.core.progress import Compiling, Progress

# What JAX records: a program that is not in memory is looked up in the compilation cache; there it is read or compiled.
REQUESTED = "/jax/compilation_cache/compile_requests_use_cache"
COMPILED = "/jax/core/compile/backend_compile_duration"
PATIENCE = 2.0  # s; what takes less is a small program, or one from the cache


class _Watch:
    """A timer beside the compilation of each thread, which reports one that takes longer than `PATIENCE`."""

    def __init__(self) -> None:
        self.progress: Progress | None = None
        # Threads with a program of `smajax.engine`, in which JAX may compile small ones of its own.
        self.native: set[int] = set()
        self._timers: dict[int, threading.Timer] = {}
        self._lock = threading.Lock()

    def on_event(self, event: str, **_: str | int) -> None:
        if event == REQUESTED:
            self.start()

    def on_duration(self, event: str, duration_secs: float, **_: str | int) -> None:
        if event == COMPILED and threading.get_ident() not in self.native:
            self.stop()

    def start(self) -> None:
        own = threading.get_ident()
        with self._lock:
            if self.progress is None or own in self._timers:
                return
            timer = self._timers[own] = threading.Timer(PATIENCE, self.progress, (Compiling(True),))
            timer.daemon = True
            timer.start()

    def stop(self, every: bool = False) -> None:
        """The end of this thread's compilation, or of every thread's."""
        with self._lock:
            ended = list(self._timers) if every else [threading.get_ident()]
            timers = [self._timers.pop(thread) for thread in ended if thread in self._timers]
            another = bool(self._timers)
        for timer in timers:
            timer.cancel()
        if timers and self.progress is not None and not another:  # while another thread compiles that is still so
            self.progress(Compiling(False))


@lru_cache(maxsize=1)
def _watch() -> _Watch:
    """The only one of the process: older versions of JAX cannot unregister a listener."""
    from jax import monitoring

    watch = _Watch()
    monitoring.register_event_listener(watch.on_event)
    monitoring.register_event_duration_secs_listener(watch.on_duration)
    return watch


@contextmanager
def compiling() -> Iterator[None]:
    """A block that traces, translates and compiles a program, which is cached."""
    watch = _watch()
    watch.start()
    own = threading.get_ident()
    within = own in watch.native
    watch.native.add(own)
    try:
        yield
    finally:
        if not within:
            watch.native.discard(own)
            watch.stop()


@contextmanager
def compilations_reported(progress: Progress) -> Iterator[None]:
    """Reports `Compiling(True)`, from another thread, of a compilation longer than `PATIENCE`, and `Compiling(False)` at its end."""
    watch = _watch()
    before, watch.progress = watch.progress, progress
    try:
        yield
    finally:
        watch.stop(every=True)
        watch.progress = before
