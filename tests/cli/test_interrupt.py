"""Ctrl-C ends a command and says what is cached."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.small_bench import bench

# A shell that runs its tests in the background has them ignore Ctrl-C, and what they start as well.
ANSWERING = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from smajax.cli.main import main; main()"
)


def _interrupted(folder: Path, words: list[str], begun: str) -> str:
    """What a command in `folder` says after Ctrl-C, which comes when it has said `begun`."""
    with subprocess.Popen(
        [sys.executable, "-c", ANSWERING, *words],
        cwd=folder,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "SMAJAX_PROGRESS": "lines"},
    ) as run:
        assert run.stderr is not None
        assert any(begun in line for line in iter(run.stderr.readline, ""))
        run.send_signal(signal.SIGINT)
        said = run.stderr.read()
    assert run.returncode == 130, said
    return said


@pytest.mark.slow  # in the middle of a fit; while the runs are read below
def test_ctrl_c_ends_a_command_with_130(tmp_path: Path) -> None:
    """The base fit has begun."""
    said = _interrupted(tmp_path, ["close-loop", str(bench(tmp_path)), "--out", "out"], "points of the box")
    assert said.index("Stopping: ") < said.index("Interrupted. ")
    assert "Interrupted. Nothing was finished: the same command starts from the beginning." in said


@pytest.mark.parametrize(
    "budget", [[], pytest.param(["--budget", "60s"], marks=pytest.mark.slow)], ids=["plain", "budget"]
)
def test_ctrl_c_while_the_runs_are_read_is_answered_in_words(tmp_path: Path, budget: list[str]) -> None:
    """No fit has begun. With --budget the work is that of a second process, and the first one alone gets the signal."""
    said = _interrupted(tmp_path, ["close-loop", str(bench(tmp_path)), "--out", "out", *budget], "loading")
    assert "Stopping: " in said
    assert "Interrupted. The same command " in said
    assert "Traceback" not in said


@pytest.mark.parametrize("finished", [True, False])
def test_an_interrupted_command_mentions_cached_work_only_if_there_is_some(tmp_path: Path, finished: bool) -> None:
    (tmp_path / "fits").mkdir()
    if finished:
        (tmp_path / "fits" / f"{'0f' * 16}.npz").write_text("")
    code = (
        "import pathlib, sys\nfrom smajax.cli.options import FITS\nfrom smajax.cli.terminal import resumable\n"
        "with resumable('Kept.', pathlib.Path(sys.argv[1]), FITS):\n    raise KeyboardInterrupt"
    )
    told = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=False)
    assert told.returncode == 130
    assert ("Interrupted. Kept." in told.stderr) is finished


def test_ctrl_c_while_garbage_is_collected_ends_the_command() -> None:
    """What a callback of the collector raises is dropped by Python: Ctrl-C is given again until it is answered."""
    code = (
        "import gc, os, signal, time\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from smajax.cli.terminal import resumable\n"
        "def swallow(phase, info):\n    gc.callbacks.remove(swallow)\n    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(0.1)\n"
        "with resumable():\n    gc.callbacks.append(swallow)\n    gc.collect()\n    print('went on', flush=True)\n"
        "    time.sleep(20)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "Exception ignored" in told.stderr
    assert told.stdout == "went on\n"
    assert told.returncode == 130
    assert "Interrupted." in told.stderr


@pytest.mark.parametrize("imported", [False, True])
def test_ctrl_c_waits_for_the_end_of_an_import(tmp_path: Path, imported: bool) -> None:
    """Compiled code that imports, and is told of an exception, aborts the process. What is around the whole program is not waited for."""
    (tmp_path / "compiled.py").write_text(
        "import os, signal, time\ntry:\n    os.kill(os.getpid(), signal.SIGINT)\n    time.sleep(0.2)\n"
        "except KeyboardInterrupt:\n    os.abort()\n"
    )
    code = (
        "import signal, time\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from smajax.cli.terminal import resumable\nwith resumable():\n    import compiled\n"
        "    print('imported', flush=True)\n    time.sleep(20)"
    )
    (tmp_path / "whole.py").write_text(code)
    told = subprocess.run(
        [sys.executable, "-c", "import whole" if imported else code],
        capture_output=True,
        text=True,
        check=False,
        timeout=15,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])},
    )
    assert told.returncode == 130, told.stderr
    assert "Interrupted." in told.stderr
