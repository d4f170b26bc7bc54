"""Several processes fill one store: the same numbers as one, and what a killed one leaves is gone on with."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from smajax.simulation.batch.run_batch import opened
from smajax.simulation.batch.store import Store

FOLDER = Path(__file__).parents[2]
WORKER = """
import sys
from smajax.core.runtime import prepare
prepare()
from smajax.simulation.batch import hosts
from smajax.engine import xla
xla.LEAST_BLOCK = 2
out, address, processes, process = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
slow = len(sys.argv) > 5 and sys.argv[5] == str(process)
at = hosts.join(address, processes, process) if processes > 1 else (0, 1)
import numpy as np
from smajax.simulation.batch.axes import grid
from smajax.model.presets import build

def progress(event):
    print("chunk", flush=True)
    if slow:
        import time
        time.sleep(3600.0)

arm = build("niti_table_3_1", "arm", "amplified_voltage")
hosts.run_batch_here(arm, {}, grid(voltage=np.linspace(5.0, 9.0, 200)), out, *at, seconds=1.0, dt=0.02, budget=450_000, progress=progress)
print("finished", flush=True)
"""


def _address() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{free.getsockname()[1]}"


def _start(out: Path, address: str, processes: int, process: int, slow: str = "") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", WORKER, str(out), address, str(processes), str(process), *([slow] if slow else [])],
        cwd=FOLDER,
        env={**os.environ, "PYTHONPATH": str(FOLDER)},
        stdout=subprocess.PIPE,
        text=True,
    )


def _together(out: Path, processes: int) -> None:
    address = _address()
    running = [_start(out, address, processes, process) for process in range(processes)]
    for one in running:
        told, _ = one.communicate(timeout=240)
        assert one.returncode == 0, told
        assert "finished" in told


@pytest.mark.slow
def test_two_processes_give_what_one_gives(tmp_path: Path) -> None:
    _together(tmp_path / "two", 2)
    _together(tmp_path / "one", 1)
    assert Store.opened(tmp_path / "two").missing() == []
    np.testing.assert_array_equal(opened(tmp_path / "two")["position"], opened(tmp_path / "one")["position"])


@pytest.mark.slow
def test_a_run_whose_process_is_killed_resumes_with_fewer_processes(tmp_path: Path) -> None:
    address = _address()
    running = [_start(tmp_path / "killed", address, 4, process, slow="2") for process in range(4)]
    assert running[2].stdout is not None
    assert running[2].stdout.readline().strip() == "chunk"
    running[2].send_signal(signal.SIGKILL)
    # The others finish their own chunks; JAX's runtime may then end them for the lost one.
    end = time.monotonic() + 200.0
    while time.monotonic() < end and len(Store.opened(tmp_path / "killed").missing()) > 3:
        time.sleep(0.5)
    for one in running:
        one.kill()
        one.communicate()  # which closes the pipe as well
    before = Store.opened(tmp_path / "killed").missing()
    assert before, "there is something left to do"
    _together(tmp_path / "killed", 2)
    _together(tmp_path / "whole", 1)
    np.testing.assert_array_equal(opened(tmp_path / "killed")["position"], opened(tmp_path / "whole")["position"])
