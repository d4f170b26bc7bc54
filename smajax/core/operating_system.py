"""What differs between Linux, macOS and Windows, in one file: locks, Ctrl-C, closed pipes, cores, memory, the user's cache.

No other file of the package calls what only some of the three have (`tests/test_platforms.py`). The tests run on Linux. What macOS
and Windows do here follows their documentation and is untested.
"""

from __future__ import annotations

import _thread
import errno
import importlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FrameType
from typing import IO, Any

WINDOWS = os.name == "nt"


class Taken(OSError):
    """Another program has the lock."""


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock file `path`, created where it is not there, until the block or the program ends, in whatever way.

    Raises Taken at once where another program has it. Without a lock where the file cannot be made or the file system has no
    locks: what is written next fails, or works as it did.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(path)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise Taken(errno.EWOULDBLOCK, "another program has the lock", str(path)) from None
    except (OSError, NotImplementedError):
        pass
    try:
        yield
    finally:
        lock.release()


def is_held(path: Path) -> bool:
    """Whether a program that `started` began with this lock file still runs, or one that it began."""
    if not path.exists() or WINDOWS:
        return False
    fcntl = importlib.import_module("fcntl")
    with path.open("rb") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)  # shared: two that look at once do not see each other
        except BlockingIOError:
            return True
    return False


# What a shell starts in the background ignores Ctrl-C, and so does what that starts: a program that is to answer has to be given it back.
_ANSWERING = (
    "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execvp(sys.argv[1], sys.argv[1:])"
)


def started(words: Sequence[str], lock: Path, **more: Any) -> subprocess.Popen[bytes]:
    """Start a program that outlives this one and its Ctrl-C, answers its own, and holds the file `lock` as long as it lives.

    more: of `subprocess.Popen`. Raises OSError on Windows, where a child cannot be given a lock.
    """
    if WINDOWS:
        raise OSError(errno.ENOSYS, "a program that outlives this one can be started on Linux and macOS only")
    fcntl = importlib.import_module("fcntl")
    handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        answering = [sys.executable, "-I", "-S", "-c", _ANSWERING, *words]
        return subprocess.Popen(answering, pass_fds=(handle,), start_new_session=True, **more)
    finally:
        os.close(handle)


def with_pipes(
    words: Callable[[int, int], Sequence[str]], environment: dict[str, str]
) -> tuple[subprocess.Popen[bytes], IO[bytes], IO[bytes]]:
    """(a program that is started, a pipe to it, one from it); `words` of the ends that it has. It has no other input or output, and Ctrl-C is not its own.

    Raises OSError where it cannot be started.
    """
    its_input, send = os.pipe()
    receive, its_output = os.pipe()
    try:
        process = subprocess.Popen(
            words(its_input, its_output),
            pass_fds=(its_input, its_output),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            env=environment,
        )
    except OSError:
        os.close(send)
        os.close(receive)
        raise
    finally:
        os.close(its_input)
        os.close(its_output)
    return process, os.fdopen(send, "wb"), os.fdopen(receive, "rb")


def interrupt(process: int) -> bool:
    """Ctrl-C to a program that `started` began, and to what that began; whether there was one."""
    try:
        os.killpg(process, signal.SIGINT)
    except ProcessLookupError:
        return False
    return True


Handler = Callable[[int, FrameType | None], Any]
Later = Callable[[float], None]


@contextmanager
def repeated_interrupts(handler: Handler) -> Iterator[Later]:
    """Have `handler` answer Ctrl-C; what is yielded has it called again after so many seconds, unless the block has ended.

    In the main thread. A system's own timer also ends a call that waits; Windows has none, and there a thread asks for the handler.
    """
    repeat, stop = _by_signal(handler) if hasattr(signal, "setitimer") else _by_thread()
    signal.signal(signal.SIGINT, handler)
    try:
        yield repeat
    finally:
        stop()
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _by_signal(handler: Handler) -> tuple[Later, Callable[[], None]]:
    before = signal.signal(signal.SIGALRM, handler)

    def repeat(seconds: float) -> None:
        signal.setitimer(signal.ITIMER_REAL, seconds)

    def stop() -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before or signal.SIG_DFL)

    return repeat, stop


def _by_thread() -> tuple[Later, Callable[[], None]]:
    waiting: list[threading.Timer] = []

    def stop() -> None:
        while waiting:
            waiting.pop().cancel()

    def repeat(seconds: float) -> None:
        stop()
        timer = threading.Timer(seconds, _thread.interrupt_main)
        timer.daemon = True  # a program that ends does not wait for it
        waiting.append(timer)
        timer.start()

    return repeat, stop


def is_closed_pipe(error: OSError) -> bool:
    """Whether the reader of our output has gone: Windows reports an invalid argument."""
    return isinstance(error, BrokenPipeError) or (WINDOWS and error.errno == errno.EINVAL)


def as_typed(words: Sequence[str]) -> str:
    """A command line that the system's shell reads as these words."""
    if WINDOWS:
        from subprocess import list2cmdline

        return list2cmdline(words)
    from shlex import join

    return join(words)


def no_room(error: OSError) -> bool:
    """Whether there is no room: on the disk, in the quota (which Windows reports as a full disk), in a file."""
    return error.errno in {getattr(errno, name, None) for name in ("ENOSPC", "EDQUOT", "EFBIG")} - {None}


def user_cache() -> Path:
    """The folder of the user's caches: `XDG_CACHE_HOME`, else `%LOCALAPPDATA%` on Windows and `~/.cache` elsewhere."""
    own = os.environ.get("XDG_CACHE_HOME") or (os.environ.get("LOCALAPPDATA") if WINDOWS else None)
    return Path(own) if own else Path.home() / ".cache"


_taken: list[int] = []


def take_cores(count: int) -> None:
    """Have `available_cores` say so many from now on."""
    _taken[:] = [count]


def available_cores() -> int:
    """Cores that this process may use; all of the machine where the system does not say."""
    if _taken:
        return _taken[0]
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min([allowed, *_quota()]))


@cache
def _quota(cap: Path = Path("/sys/fs/cgroup/cpu.max")) -> tuple[int, ...]:
    """Cores whose time a container may take, part of one counted as one; none where there is no cap."""
    with suppress(OSError, ValueError):
        most, period = cap.read_text(encoding="ascii").split()
        return (-(-int(most) // int(period)),)
    return ()


def load_average() -> float | None:
    """Programs that wanted a core, on average over the last minute; None where the system does not say."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def processor_name() -> str:
    """As Linux lists it; "" elsewhere."""
    return next((value for name, value in _entries("/proc/cpuinfo") if name == "model name"), "")


def peak_memory() -> int:
    """Most bytes that this process has had in memory so far. Raises OSError on Windows, which has no such count for Python."""
    resource = _resource()
    if resource is None:
        raise OSError(errno.ENOSYS, "the peak of this process's memory is known on Linux and macOS only")
    unit = 1 if sys.platform == "darwin" else 1024
    return int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * unit


def available_memory() -> int | None:
    """Bytes that a program may still take without swapping and within its caps; None where the system does not say."""
    limits = [*_free(), *_below_caps()]
    return max(0, min(limits)) if limits else None


def _resource() -> Any:
    """The module of that name; None on Windows."""
    try:
        return importlib.import_module("resource")
    except ImportError:
        return None


def _entries(path: str) -> list[tuple[str, str]]:
    """Lines `name: value` of a file of Linux; none where there is no such file."""
    file = Path(path)
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines() if file.exists() else []
    return [(name.strip(), value.strip()) for name, colon, value in (line.partition(":") for line in lines) if colon]


def _free() -> list[int]:
    """Of the machine, and of the container that it may be."""
    result = [1024 * int(value.split()[0]) for name, value in _entries("/proc/meminfo") if name == "MemAvailable"]
    group = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):  # no container, or one without a cap
        most, taken = ((group / name).read_text(encoding="ascii") for name in ("memory.max", "memory.current"))
        result.append(int(most) - int(taken))
    return result


def _below_caps() -> list[int]:
    """What `ulimit -v` and `ulimit -d` leave to this process."""
    file, resource, result = Path("/proc/self/statm"), _resource(), []
    if file.exists() and resource is not None:
        pages = [int(part) for part in file.read_text(encoding="ascii").split()]
        for cap, taken in ((resource.RLIMIT_AS, pages[0]), (resource.RLIMIT_DATA, pages[5])):
            soft = resource.getrlimit(cap)[0]
            if soft != resource.RLIM_INFINITY:
                result.append(soft - taken * resource.getpagesize())
    return result
