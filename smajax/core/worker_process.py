"""A second Python process, which calls functions while this one goes on: one process runs Python on one core.

`worker_process` starts it for a block. Within the block `begin` has a function called there, and `taken` gives what it returned, or nothing
where it was not called yet or failed: then the caller calls it itself. So a study is quicker by it, and never another one.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import parent_process
from pathlib import Path
from typing import Any, Generic, TypeVar

from smajax.core.operating_system import WINDOWS, available_cores
from smajax.core.serving import read, written

Result = TypeVar("Result")
VARIABLE = "SMAJAX_WORKER"
NEVER = "none"
# What an attribution and its page ask for is in these, whose import takes longer than the base fit.
OF_ATTRIBUTION = ("smajax.engine.native", "smajax.attribution.begun_ahead")
OF_REPORT = ("smajax.report.html",)
THREADS_OF = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
PROGRAM = "import sys; sys.path[:] = {}; from smajax.core.serving import serve; serve({})"


class Worker:
    """The process, and what it returned or will return."""

    def __init__(self, imports: Sequence[str]) -> None:
        """`imports`: modules that it imports before the first call. Raises OSError where it cannot be started."""
        # Modules are found where this process finds them; it takes no card.
        self._process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM.format(sys.path, list(imports))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is the first process's
            env={**os.environ, **dict.fromkeys(THREADS_OF, "1"), "JAX_PLATFORMS": "cpu"},
        )
        self._pool = ThreadPoolExecutor(1)
        self._lock = threading.Lock()
        self._waiting: OrderedDict[Hashable, bytes] = OrderedDict()  # calls that were not sent yet
        self._called: dict[Hashable, Future[Any]] = {}

    def begin(self, key: Hashable, function: Callable[..., Any], arguments: tuple[Any, ...], first: bool) -> None:
        """Have a function called, after those that wait or before them."""
        with self._lock:
            if key in self._called:
                return
            if key not in self._waiting:
                try:
                    self._waiting[key] = pickle.dumps((_settings(), function, arguments))
                except Exception:  # a class of the user's script, say: then the caller calls it
                    return
                self._pool.submit(self._next)
            self._waiting.move_to_end(key, last=not first)

    def _next(self) -> None:
        with self._lock:
            if not self._waiting:  # the caller has called it
                return
            key, call = self._waiting.popitem(last=False)
            coming = self._called[key] = Future()
        try:
            coming.set_result(self._answer(call))
        except Exception as error:
            coming.set_exception(error)

    def _answer(self, call: bytes) -> Any:
        send, receive = self._process.stdin, self._process.stdout
        assert send is not None
        assert receive is not None
        send.write(written(call))
        send.flush()
        done, answer = pickle.loads(read(receive))
        if not done:
            raise RuntimeError(answer)
        return answer

    def is_called(self, key: Hashable) -> bool:
        """Whether a function has been called, and may have returned."""
        return key in self._called

    def taken(self, key: Hashable) -> tuple[Any] | None:
        """(what a function returned,), for which this waits where it was called; None where it was not, or failed. It is then forgotten."""
        with self._lock:
            self._waiting.pop(key, None)
            coming = self._called.pop(key, None)
        if coming is not None:
            with suppress(Exception):
                return (coming.result(),)
        return None

    def close(self) -> None:
        """End the process, whatever it is at."""
        with self._lock:
            self._waiting.clear()
        self._process.kill()
        self._pool.shutdown(wait=True)
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
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

    Without one on a single core, in a process of `multiprocessing`, on Windows, where it was never tried, and where the environment variable SMAJAX_WORKER is "none". `imports`: modules that it imports while it waits.
    """
    global _worker
    if _worker is not None or not _wanted():
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


def _wanted() -> bool:
    if parent_process() is not None:  # one of several processes that share the cores already
        return False
    # A program that runs Python within itself is not to be started a second time.
    is_python = Path(sys.executable or "").name.lower().startswith("python")
    return is_python and not WINDOWS and os.environ.get(VARIABLE) != NEVER and available_cores() > 1


def begin(key: Hashable, function: Callable[..., Any], arguments: tuple[Any, ...], first: bool = False) -> None:
    """Have a function of a module called by the second process, where there is one. `first`: before those that wait."""
    if _worker is not None:
        _worker.begin(key, function, arguments, first)


def is_called(key: Hashable) -> bool:
    """Whether the second process has called it, and may have returned."""
    return _worker is not None and _worker.is_called(key)


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


def in_two_processes(function: Callable[..., Result], calls: Sequence[tuple[Any, ...]]) -> list[Result]:
    """What a function of a module returns for each of `calls`, its arguments; every second one is called by the second process, where there is one."""
    there = [begin_call(partial(function, *one), function, *one) for one in calls[1::2]]
    here = [function(*one) for one in calls[::2]]
    found = iter([*here, *(one.result() for one in there)])
    in_order: list[Any] = [None] * len(calls)
    in_order[::2] = [next(found) for _ in here]
    in_order[1::2] = list(found)
    return in_order


def begin_call(here: Callable[[], Result], function: Callable[..., Result], *arguments: Any) -> Call[Result]:
    """Have a function called by the second process, where there is one; `here` is the same call by this one, with what shows its progress."""
    result = Call(here)
    begin(result, function, arguments)
    return result
