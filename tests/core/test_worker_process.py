"""A second process that calls functions: what it returns, and that the caller calls what it cannot."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from functools import partial
from pathlib import Path

import jax
import numpy as np
import pytest

from smajax.core import worker_process as module
from smajax.core.operating_system import available_cores
from smajax.core.worker_process import VARIABLE, begin, begin_call, in_two_processes, is_called, taken, worker_process

PATIENCE = 30.0  # s


@pytest.fixture
def wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(module, "available_cores", lambda: 2)


@pytest.fixture
def started(wanted: None) -> Iterator[module.Worker]:
    with worker_process(("tests.core.test_worker_process",)):
        assert module._worker is not None
        yield module._worker


def here_only() -> str:
    return "here"


def test_a_call_returns_what_the_second_process_returned(started: module.Worker) -> None:
    call = begin_call(os.getpid, os.getpid)
    wait_for(call)
    assert call.result() == started._process.pid != os.getpid()
    assert call.result() == os.getpid()  # it is forgotten once it was taken


def test_calls_are_made_in_order_and_one_may_go_first(started: module.Worker) -> None:
    begin("long", time.sleep, (0.5,))
    wait_for("long")
    for key in ("second", "third"):
        begin(key, time.time_ns, ())
    begin("first", time.time_ns, (), first=True)
    times = []
    for key in ("first", "second", "third"):
        wait_for(key)
        found = taken(key)
        assert found is not None
        times.append(found[0])
    assert times == sorted(times)


def test_what_was_not_called_yet_is_called_here_and_not_there(started: module.Worker) -> None:
    begin("long", time.sleep, (1.0,))
    wait_for("long")
    call = begin_call(here_only, os.getpid)
    assert call.result() == "here"
    begin("next", os.getpid, ())
    wait_for("next")
    assert taken("next") == (started._process.pid,)


def test_what_was_called_is_not_forgotten_where_the_waiting_for_it_is_interrupted(
    started: module.Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin("slow", os.getpid, ())
    wait_for("slow")

    class Interrupted(Future[int]):
        def result(self, timeout: float | None = None) -> int:
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setitem(started._called, "slow", Interrupted())
        with pytest.raises(KeyboardInterrupt):
            taken("slow")
        assert is_called("slow")
    assert taken("slow") == (started._process.pid,)
    assert not is_called("slow")


def test_whether_it_has_anything_to_do_is_said(started: module.Worker) -> None:
    begin("ready", os.getpid, ())
    wait_for("ready")
    assert module.is_begun("ready")
    assert taken("ready") is not None
    assert module.is_idle()
    begin("long", time.sleep, (60.0,))
    wait_for("long")
    begin("waits", os.getpid, ())
    assert not module.is_idle()
    assert module.is_begun("waits")
    started._process.kill()
    assert taken("long") is None
    assert not module.is_idle()
    assert not module.is_begun("waits")


def test_a_function_that_fails_there_is_called_here(started: module.Worker) -> None:
    call = begin_call(here_only, partial(int, "none"))
    wait_for(call)
    assert call.result() == "here"
    call = begin_call(here_only, lambda: "there")  # which cannot be sent
    assert not is_called(call)
    assert call.result() == "here"


def test_what_a_function_prints_is_no_answer(started: module.Worker) -> None:
    call = begin_call(here_only, print, "a line")
    wait_for(call)
    assert call.result() is None


def test_the_second_process_has_the_settings_of_jax_and_one_core(started: module.Worker) -> None:
    zero = begin_call(lambda: np.zeros(()), jax.numpy.zeros, ())
    cores = begin_call(lambda: 0, available_cores)
    wait_for(cores)
    found = zero.result()
    assert isinstance(found, jax.Array)
    assert found.dtype == np.float64
    assert cores.result() == 1


def test_every_second_call_is_made_there_and_the_results_are_in_order(started: module.Worker) -> None:
    begin("ready", os.getpid, ())
    wait_for("ready")
    assert taken("ready") is not None  # it has imported what it needs
    assert in_two_processes(max, [(k, 2) for k in range(5)]) == [2, 2, 2, 3, 4]
    pids = in_two_processes(_after, [(0.5,), (0.0,)])
    assert pids == [os.getpid(), started._process.pid]
    assert in_two_processes(max, []) == []


def test_a_process_that_has_ended_is_done_without(started: module.Worker) -> None:
    begin("long", time.sleep, (60.0,))
    wait_for("long")
    started._process.kill()
    assert taken("long") is None
    for _ in range(2):
        call = begin_call(here_only, os.getpid)
        assert not is_called(call)
        assert call.result() == "here"


def test_it_reads_nothing_from_the_user(started: module.Worker) -> None:
    call = begin_call(here_only, input, "a question")
    wait_for(call)
    assert call.result() == "here"


PRINTS = "import sys; sys.stdout.write('a line of 17 bytes'); sys.stdout.flush()"
ENDS = """
import os, signal, time
from smajax.core import worker_process as module
with module.worker_process():
    module.begin("first", os.getpid, ())
    while not module.is_called("first"):
        time.sleep(0.01)
    print(module.taken("first")[0], flush=True)
    module.begin("long", time.sleep, (600.0,))
    while not module.is_called("long"):
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_it_ends_with_the_first_process_whatever_it_is_at(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(PRINTS)  # is no answer either
    path = os.pathsep.join([str(tmp_path), *(one for one in sys.path if one)])
    environment = {**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}
    environment.pop(VARIABLE)
    done = subprocess.run(
        [sys.executable, "-c", f"import os; os.sched_getaffinity = lambda _: (0, 1)\n{ENDS}"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    second = int(done.stdout.split("bytes")[-1])
    deadline = time.monotonic() + PATIENCE
    while Path(f"/proc/{second}").exists() and _state(second) != "Z":
        assert time.monotonic() < deadline, "the second process goes on"
        time.sleep(0.05)


def _state(process: int) -> str:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0]
    return "Z"


def test_it_gets_no_interrupt_and_ends_with_the_block(wanted: None) -> None:
    with worker_process():
        first = module._worker
        assert first is not None
        assert os.getpgid(first._process.pid) != os.getpgid(0)
        with worker_process():
            assert module._worker is first
        begin("long", time.sleep, (60.0,))
        wait_for("long")
        begun = time.monotonic()
    assert time.monotonic() - begun < PATIENCE
    assert first._process.returncode is not None
    assert not is_called("long")


@pytest.mark.parametrize("why", ["variable", "cores", "windows", "room", "thread"])
def test_without_it_everything_is_called_here(wanted: None, monkeypatch: pytest.MonkeyPatch, why: str) -> None:
    def no_room(*_: object, **__: object) -> None:
        raise OSError("no room")

    def no_thread(_: object) -> None:
        raise RuntimeError("can't start new thread")

    if why == "variable":
        monkeypatch.setenv(VARIABLE, "None")
    elif why == "cores":
        monkeypatch.setattr(module, "available_cores", lambda: 1)
    elif why == "windows":
        monkeypatch.setattr(module, "WINDOWS", True)
    elif why == "room":
        monkeypatch.setattr(subprocess, "Popen", no_room)
    else:
        monkeypatch.setattr(threading.Thread, "start", no_thread)
    with worker_process():
        assert module._worker is None
        call = begin_call(here_only, os.getpid)
        assert call.result() == "here"
        assert not is_called(call)


def _after(seconds: float) -> int:
    time.sleep(seconds)
    return os.getpid()


def wait_for(key: object) -> None:
    """Until the second process has been asked."""
    deadline = time.monotonic() + PATIENCE
    while not is_called(key):
        assert time.monotonic() < deadline, "the second process does not answer"
        time.sleep(0.01)
