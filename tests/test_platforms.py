"""Linux, macOS and Windows: what only some of them have is called in one file, and what the others do there is tried here."""

from __future__ import annotations

import ast
import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from smajax.core import operating_system
from smajax.core.operating_system import Taken, as_typed, is_closed_pipe, locked, user_cache
from smajax.engine import EngineWarning, facade

PACKAGE = Path(__file__).parents[1] / "smajax"
THE_FILE = "core/operating_system.py"
# Modules and names that Windows lacks, or macOS: https://docs.python.org/3/library/os.html and its neighbours.
MODULES = {"fcntl", "grp", "msvcrt", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "winreg", "_winapi"}
OS_NAMES = {
    *("fork", "forkpty", "getloadavg", "getpgid", "getuid", "geteuid", "getgid", "kill", "killpg", "mkfifo", "nice"),
    *("posix_spawn", "register_at_fork", "sched_getaffinity", "sched_setaffinity", "setsid", "startfile", "statvfs"),
    *("sysconf", "uname", "wait", "waitpid", "O_CLOEXEC", "O_NOFOLLOW", "O_NONBLOCK", "WNOHANG"),
}
SIGNAL_NAMES = {
    *("SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGQUIT", "SIGUSR1", "SIGUSR2", "SIGPIPE", "ITIMER_REAL", "alarm"),
    *("setitimer", "pause", "pthread_kill", "siginterrupt", "sigwait", "CTRL_C_EVENT"),
}
ERRNO_NAMES = {"EDQUOT"}
OF = {"os": OS_NAMES, "signal": SIGNAL_NAMES, "errno": ERRNO_NAMES}


def of_one_system(source: str) -> Iterator[str]:
    """What a file uses that not every system has, and text files that it opens in the system's own encoding."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if one.name.partition(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom):
            yield from [node.module] if node.module in MODULES else ()
            yield from (f"{node.module}.{one.name}" for one in node.names if one.name in OF.get(node.module or "", ()))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            yield from [f"{node.value.id}.{node.attr}"] if node.attr in OF.get(node.value.id, ()) else ()
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            named = {one.arg for one in node.keywords}
            if node.func.attr in ("read_text", "write_text") and not node.args[node.func.attr == "write_text" :]:
                yield from [] if "encoding" in named else [f"{node.func.attr} without an encoding"]


def test_one_file_calls_what_only_some_systems_have() -> None:
    found = {
        path.relative_to(PACKAGE).as_posix(): set(of_one_system(path.read_text("utf-8")))
        for path in PACKAGE.rglob("*.py")
    }
    assert {"os.getloadavg", "signal.setitimer", "os.sched_getaffinity"} <= found.pop(THE_FILE)
    assert {path: names for path, names in found.items() if names} == {}


@pytest.mark.parametrize(
    "line",
    [
        "import fcntl",
        "from os import fork",
        "os.kill(1, 9)",
        "signal.SIGKILL",
        "path.read_text()",
        "path.write_text(text)",
    ],
)
def test_the_search_finds_it(line: str) -> None:
    assert list(of_one_system(line))


def test_a_lock_keeps_others_out_until_its_program_ends(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom smajax.core.operating_system import locked\n"
        "with locked(Path(sys.argv[1])):\n    print('in', flush=True)\n    time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "in\n"
        with pytest.raises(Taken), locked(path):
            pass
        other.kill()
    with locked(path), pytest.raises(Taken), locked(path):
        pass
    with locked(tmp_path / "no" / "such" / "folder"):  # what is written next fails, and says so
        pass


def test_without_a_timer_of_the_system_a_thread_repeats_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows: the handler is asked for again, and no more once the block has ended."""
    monkeypatch.delattr(signal, "setitimer")
    calls: list[float] = []

    def answer(number: int, frame: object) -> None:
        calls.append(time.perf_counter())
        if len(calls) < 3:
            repeat(0.02)

    before = signal.getsignal(signal.SIGINT)
    try:
        with operating_system.repeated_interrupts(answer) as repeat:
            signal.raise_signal(signal.SIGINT)
            end = time.perf_counter() + 5.0
            while len(calls) < 3 and time.perf_counter() < end:
                time.sleep(0.005)
            repeat(0.05)
        time.sleep(0.1)
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(calls) == 3


def test_what_windows_does_otherwise(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    closed, other = OSError(errno.EINVAL, "Invalid argument"), OSError(errno.EIO, "broken")
    assert is_closed_pipe(BrokenPipeError())
    assert not is_closed_pipe(closed)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    assert user_cache() != tmp_path
    assert as_typed(["a b", "c"]) == "'a b' c"
    monkeypatch.setattr(operating_system, "WINDOWS", True)
    assert is_closed_pipe(closed)
    assert not is_closed_pipe(other)
    assert user_cache() == tmp_path
    assert as_typed(["a b", "c"]) == '"a b" c'


def test_without_the_systems_counts_cores_and_memory_are_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where the modules and functions that tell them are missing."""
    for name in ("getloadavg", "sched_getaffinity"):
        monkeypatch.delattr(os, name, raising=False)
    monkeypatch.setitem(sys.modules, "resource", None)
    monkeypatch.setattr(operating_system, "Path", lambda path: Path("/no/such/folder") / path.lstrip("/"))
    assert operating_system.load_average() is None
    assert operating_system.available_cores() == (os.cpu_count() or 1)
    assert operating_system.available_memory() is None
    assert operating_system.processor_name() == ""
    with pytest.raises(OSError, match="known on Linux and macOS only"):
        operating_system.peak_memory()


def test_machine_code_is_made_on_windows_only_when_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(facade, "WINDOWS", True)
    monkeypatch.setattr(facade, "_said", set())
    monkeypatch.delenv(facade.VARIABLE, raising=False)
    with pytest.warns(EngineWarning, match="never tried on Windows"):
        made = facade.program(lambda model, own: model + own["a"], 1.0, ("a",))
    assert made.native is None
