"""kill -9 at random moments of a command, then the same command again: the same result, and never half a file in sight."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import re
import signal
import subprocess
import sys
import time as clock
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from smajax.cli.result_folder import LOCK, MARK
from tests.helpers.small_bench import bench

FAST, SLOW = 1, 10  # kills of each command
ONE_EFFECT = ("[sampling]", '[effects]\nonly = ["latent_heat"]\n[sampling]')
COMMANDS = {
    "identify": "identify {bench} --starts 2",
    "close-loop": "close-loop {bench}",
    "figures": "figures M9 M18 --fast --no-open",
    "sweep": "sweep --controllers pid,vsc2 --points 2 --set-points 20 --gain-ratios 1 --seconds 1 --no-open",
    "tune": "tune pid --fast --set-points 20 --starts 1 --rounds 2 --seconds 1 --no-open",
}
# What says when and how a result was made, not what it is.
ABOUT = {"provenance", "command", "seconds", "made_with", "made with", "from", "date", "reused"}


def _begun(command: str, out: Path, bench_folder: Path) -> subprocess.Popen[str]:
    words = [*command.format(bench=bench_folder).split(), "--out", str(out)]
    return subprocess.Popen(
        [sys.executable, "-m", "smajax", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "SMAJAX_PROGRESS": ""},
    )


def _ended(run: subprocess.Popen[str]) -> None:
    _, said = run.communicate(timeout=580)
    assert run.returncode in (0, 3), said  # 3: a claim or a limit that is not met, which is a result too


def check_whole(out: Path) -> None:
    """Every file that a user sees is one that a program can read to its end."""
    for path in out.rglob("*") if out.exists() else ():
        if not path.is_file() or path.name.startswith("."):
            continue
        with contextlib.suppress(FileNotFoundError):  # of another's `rglob`, between two looks
            content = path.read_bytes()
            match path.suffix:
                case ".json":
                    json.loads(content)
                case ".png":
                    assert content.endswith(b"IEND\xaeB`\x82"), path
                case ".html":
                    assert content.rstrip().endswith(b"</html>"), path
                case ".npz":
                    with np.load(path, allow_pickle=False) as held:
                        assert all(held[name] is not None for name in held.files)
                case ".nc":
                    xr.load_dataset(io.BytesIO(content), engine="scipy")
                case ".toml":
                    tomllib.loads(content.decode())
                case ".csv" | ".md":
                    assert content.endswith(b"\n"), path
                case other:
                    raise AssertionError(f"{path}: a file of kind {other!r} that nobody looks after")


def _without(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without(one) for key, one in value.items() if key not in ABOUT}
    return [_without(one) for one in value] if isinstance(value, list) else value


def result(out: Path) -> dict[str, Any]:
    """What a folder says, by file: numbers of records and tables, pictures to the byte, arrays."""
    found: dict[str, Any] = {}
    for path in sorted(out.rglob("*")):
        if path.suffix == ".json" and path.name != MARK:
            found[path.name] = _without(json.loads(path.read_text(encoding="utf-8")))
        elif path.suffix in (".csv", ".md", ".png"):
            found[path.name] = path.read_bytes()
        elif path.suffix == ".nc":
            read = xr.load_dataset(path, engine="scipy")
            # As text: "never" is a nan there, which is no other nan.
            found[path.name] = {name: repr(read[name].to_numpy().tolist()) for name in read.variables}
        elif path.suffix == ".npz":
            with np.load(path) as held:
                found[path.name] = {name: held[name].tolist() for name in held.files}
    return found


def _finished(out: Path) -> dict[str, int]:
    """When each finished piece of work was written."""
    pieces = [*out.glob("finished/*.npz"), *(one for one in out.glob("*.json") if re.match(r"[MC]\d+\.json", one.name))]
    return {str(path): path.stat().st_mtime_ns for path in pieces}


def _kill_at(command: str, out: Path, folder: Path, moment: float, length: float) -> bool:
    """Begin the command and kill it at that share of the time from its folder's mark on; whether it was still at work."""
    run = _begun(command, out, folder)
    while not (out / MARK).exists() and run.poll() is None:
        clock.sleep(0.01)
    until = clock.monotonic() + moment * length
    while clock.monotonic() < until and run.poll() is None:
        check_whole(out)
        clock.sleep(0.02)
    killed = run.poll() is None
    run.send_signal(signal.SIGKILL)
    run.communicate()
    check_whole(out)
    return killed


def kill_and_resume(tmp_path: Path, name: str, kills: int) -> None:
    """Asserts that the command gives the undisturbed result after so many kills."""
    command = COMMANDS[name]
    folder = bench(tmp_path / "bench", ONE_EFFECT).parent
    whole = tmp_path / "whole"
    run = _begun(command, whole, folder)
    while not (whole / MARK).exists() and run.poll() is None:
        clock.sleep(0.01)
    began = clock.monotonic()
    _ended(run)
    length = clock.monotonic() - began
    check_whole(whole)
    moments = random.Random(f"{name} {kills}")
    out = tmp_path / "out"
    killed = 0
    for _ in range(kills):
        before = _finished(out)
        killed += _kill_at(command, out, folder, moments.uniform(0.05, 0.9), length)
        assert _finished(out).items() >= before.items()  # what was finished is not done again
    before = _finished(out)
    _ended(_begun(command, out, folder))
    assert _finished(out).items() >= before.items()
    assert killed or kills == FAST, "no kill found the command at work"
    assert result(out) == result(whole)
    assert not [one for one in out.rglob(".*") if one.name not in (MARK, LOCK) and one.name != ".made-by"], (
        "left behind"
    )
