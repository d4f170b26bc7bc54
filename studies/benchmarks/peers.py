"""Starts a peer as a user would: a process of its own, in an environment of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
DIFFRAX_PYTHON = "SMAJAX_DIFFRAX_PYTHON"
GRADSOLVE_PYTHON = "SMAJAX_GRADSOLVE_PYTHON"
NUMBA_PYTHON = "SMAJAX_NUMBA_PYTHON"
LONGEST = 3600.0  # s


def run_peer(
    name: str, python: str, *options: str, longest: float = LONGEST, package: str = "studies.benchmarks"
) -> dict[str, Any]:
    """What `<package>.<name>` prints with these options; or {"peer", "reason"} where it could not run."""
    command = [python, "-m", f"{package}.{name}", *options]
    # Our own search path and XLA's flags are not the peer's.
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "XLA_FLAGS")}
    try:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=longest)
    except (OSError, subprocess.TimeoutExpired) as error:
        return {"peer": name, "reason": str(error)}
    lines = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
    if done.returncode != 0:
        return {"peer": name, "reason": lines[-1] if lines else f"exit status {done.returncode}"}
    try:
        return dict(json.loads(lines[-1]))
    except (IndexError, ValueError):
        return {"peer": name, "reason": "printed no result"}


def scipy(file: Path, count: int = 64) -> dict[str, Any]:
    """scipy on one core, in our own environment; `count` members are timed."""
    return run_peer("scipy_peer", sys.executable, str(file.resolve()), "--count", str(count))


def _elsewhere(name: str, package: str, variable: str, python: str | None, *options: str) -> dict[str, Any]:
    """`run_peer` by the interpreter `python`, or the one that `variable` names: one that can import `package`."""
    python = python or os.environ.get(variable)
    if not python:
        reason = f"not installed here: set {variable} to an interpreter that can import {package}"
        return {"peer": package, "reason": reason}
    return run_peer(name, python, *options)


def diffrax(file: Path, python: str | None = None, cores: int | None = None, count: int = 4096) -> dict[str, Any]:
    """diffrax by the interpreter `python`, or the one that SMAJAX_DIFFRAX_PYTHON names: one that can import diffrax."""
    several = () if cores is None else ("--cores", str(cores))
    options = (str(file.resolve()), "--count", str(count), *several)
    return _elsewhere("diffrax_peer", "diffrax", DIFFRAX_PYTHON, python, *options)


def numba(file: Path, dt: float, python: str | None = None, count: int = 4096) -> dict[str, Any]:
    """numba with steps of `dt` s by the interpreter `python`, or the one that SMAJAX_NUMBA_PYTHON names."""
    options = (str(file.resolve()), "--dt", repr(dt), "--count", str(count))
    return _elsewhere("numba_peer", "numba", NUMBA_PYTHON, python, *options)


def gradient(peer: str, file: Path, python: str | None = None) -> dict[str, Any]:
    """The gradient of a problem of `tracking.py` by `diffrax` or `gradsolve`, each by the interpreter named for it."""
    variable = {"diffrax": DIFFRAX_PYTHON, "gradsolve": GRADSOLVE_PYTHON}[peer]
    return _elsewhere("gradient_peer", peer, variable, python, peer, str(file.resolve()))
