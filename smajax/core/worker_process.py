"""A second Python process, which calls functions while this one goes on: one process runs Python on one core.

`worker_process` starts it for a block. Within the block `begin` has a function called there, and `taken` gives what it returned, or nothing
where it was not called yet or failed: then the caller calls it itself. It imports modules as they are on the disk, so only our own commands
start one: a script may have changed them.
"""

from __future__ import annotations

import os
import pickle
import sys
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from smajax.core.operating_system import WINDOWS, available_cores, with_pipes
from smajax.core.serving import read, written

Result = TypeVar("Result")
VARIABLE = "SMAJAX_WORKER"
NEVER = ("none", "no", "off", "false", "0")
THREADS_OF = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
PROGRAM = "import sys; sys.path[:] = {}; from smajax.core.serving import serve; serve({}, {}, {}, {})"
# What an attribution and its page ask for is in these, whose import takes longer than the base fit.
OF_ATTRIBUTION = ("smajax.engine.native", "smajax.attribution.begun_ahead", "smajax.report.html")


class Worker:
    """The process, and what it returned or will return."""

    def __init__(self, imports: Sequence[str]) -> None:
        """`imports`: modules that it imports before the first call. Raises OSError or RuntimeError where it cannot be started."""
        path = [one for one in sys.path if isinstance(one, str)]  # modules are found where this process finds them

        def words(calls: int, answers: int) -> list[str]:
            return [sys.executable, "-c", PROGRAM.format(path, list(imports), calls, answers, os.getpid())]

        # It takes no card, and starts no process like itself.
        own = {**dict.fromkeys(THREADS_OF, "1"), "JAX_PLATFORMS": "cpu", VARIABLE: NEVER[0]}
        self._process, self._send, self._receive = with_pipes(words, {**os.environ, **own})
        self._changed = threading.Condition()
        self._waiting: OrderedDict[Hashable, bytes] = OrderedDict()  # calls that were not sent yet
        self._called: dict[Hashable, Future[Any]] = {}
        self._ended = False
        try:
            threading.Thread(target=self._go_on, daemon=True).start()
        except RuntimeError:  # no room for another thread under a cap on memory
            self.close()
            raise

    def begin(self, key: Hashable, function: Callable[..., Any], arguments: tuple[Any, ...], first: bool) -> None:
        """Have a function called, after those that wait or before them; never raises."""
        with self._changed:
            if key in self._called or self._ended:
                return
            if key not in self._waiting:
                try:
                    self._waiting[key] = pickle.dumps((_settings(), function, arguments))
                except Exception:  # what has no name in a module, say: then the caller calls it
                    return
            self._waiting.move_to_end(key, last=not first)
            self._changed.notify()

    def _go_on(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ended)
                if self._ended:
                    return
                key, call = self._waiting.popitem(last=False)
                coming = self._called[key] = Future()
            try:
                self._send.write(written(call))
                self._send.flush()
                done, answer = pickle.loads(read(self._receive))
            except Exception as error:  # it has ended, or says what is no answer
                self._end()
                coming.set_exception(error)
                return
            if done:
                coming.set_result(answer)
            else:
                coming.set_exception(RuntimeError(answer))

    def _end(self) -> None:
        with self._changed:
            self._ended = True
            self._waiting.clear()
            self._changed.notify()
        self._process.kill()

    def is_called(self, key: Hashable) -> bool:
        """Whether a function has been called, and may have returned."""
        return key in self._called

    def is_begun(self, key: Hashable) -> bool:
        """Whether a function is called, or waits for it."""
        with self._changed:  # between the two it is in neither
            return key in self._called or key in self._waiting

    def is_idle(self) -> bool:
        """Whether nothing is called and nothing waits."""
        return not self._ended and not self._waiting and all(one.done() for one in tuple(self._called.values()))

    def taken(self, key: Hashable) -> tuple[Any] | None:
        """(what a function returned,), for which this waits where it was called; None where it was not, or failed. It is then forgotten, and not where the waiting is interrupted."""
        with self._changed:
            self._waiting.pop(key, None)
            coming = self._called.get(key)
        answer = None
        if coming is not None:
            with suppress(Exception):
                answer = (coming.result(),)
            self._called.pop(key, None)
        return answer

    def close(self) -> None:
        """End the process, whatever it is at."""
        self._end()
        self._process.wait()
        for pipe in (self._send, self._receive):
            with suppress(OSError):  # what was to be sent
                pipe.close()


def _settings() -> dict[str, Any]:
    """JAX's own, which this process may have changed."""
    import jax
    import jax.numpy as jnp

    plain = bool, int, float, str, type(None)
    values = {name: value for name, value in jax.config.values.items() if isinstance(value, plain)}
    return {**values, "jax_enable_x64": jnp.zeros(()).dtype == jnp.float64}


_worker: Worker | None = None


@contextmanager
def worker_process(imports: Sequence[str] = ()) -> Iterator[None]:
    """A block beside which a second process calls functions; one within another has the same process.

    Without one on a single core, on Windows, where it was never tried, and where the environment variable SMAJAX_WORKER is "none". `imports`: modules that it imports while it waits.
    """
    global _worker
    wanted = not WINDOWS and os.environ.get(VARIABLE, "").lower() not in NEVER and available_cores() > 1
    if _worker is not None or not wanted:
        yield
        return
    with suppress(OSError, RuntimeError):  # no room for another process or thread
        _worker = Worker(imports)
    try:
        yield
    finally:
        ended, _worker = _worker, None
        if ended is not None:
            ended.close()


def is_there() -> bool:
    """Whether there is a second process."""
    return _worker is not None


def begin(key: Hashable, function: Callable[..., Any], arguments: tuple[Any, ...], first: bool = False) -> None:
    """Have a function of a module called by the second process, where there is one. `first`: before those that wait."""
    if _worker is not None:
        _worker.begin(key, function, arguments, first)


def is_called(key: Hashable) -> bool:
    """Whether the second process has called it, and may have returned."""
    return _worker is not None and _worker.is_called(key)


def is_begun(key: Hashable) -> bool:
    """Whether the second process calls it, or will, if nothing happens to it."""
    return _worker is not None and _worker.is_begun(key)


def is_idle() -> bool:
    """Whether there is a second process, and it has nothing to do."""
    return _worker is not None and _worker.is_idle()


def taken(key: Hashable) -> tuple[Any] | None:
    """(what the second process has returned, or soon will,) under this key; None: the caller is to call the function."""
    return None if _worker is None else _worker.taken(key)


@dataclass(frozen=True, eq=False)
class Call(Generic[Result]):
    """A call of a function of a module, which the second process may have made."""

    here: Callable[[], Result]

    def result(self) -> Result:
        """What it returned there; where it was not called there, or failed, what `here` returns."""
        found = taken(self)
        return self.here() if found is None else found[0]


def begin_call(
    here: Callable[[], Result], function: Callable[..., Result], *arguments: Any, first: bool = False
) -> Call[Result]:
    """Have a function called by the second process, where there is one; `here` is the same call by this one, with what shows its progress. `first`: before those that wait."""
    result = Call(here)
    begin(result, function, arguments, first)
    return result


def in_two_processes(function: Callable[..., Result], calls: Sequence[tuple[Any, ...]]) -> list[Result]:
    """What a function of a module returns for each of `calls`, its arguments; every second one is called by the second process, where there is one."""
    there = [begin_call(partial(function, *one), function, *one) for one in calls[1::2]]
    results: list[Any] = [None] * len(calls)
    results[::2] = [function(*one) for one in calls[::2]]
    results[1::2] = [one.result() for one in there]
    return results
