"""The work: one command of the command line at a time, in a process of its own, that a killed server does not take with it.

A hidden folder in the project holds what was started, the events that the command writes (`SMAJAX_PROGRESS=json`) and its output. That a
process still runs is known from a file lock that it holds until it ends in any way. Linux and macOS only: on Windows a job says that it cannot be started.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from smajax.core.files import json_text, replace
from smajax.core.operating_system import interrupt, is_held, started

HIDDEN = ".smajax-app"
RECORD, EVENTS, OUTPUT, LOCK, ENDED = "job.json", "events.jsonl", "output.json", "lock", "ended.json"
PROGRAM = (sys.executable, "-m", "smajax")
INTERRUPTED, NOT_MET = 130, 3  # exit codes of the command line, see `smajax --help`


class JobError(ValueError):
    """Work that cannot be started."""


@dataclass(frozen=True)
class Job:
    """What was started last in a project: a command (`close-loop`), its words, its result folder, and how it is with it.

    about: what the page needs to show its events, JSON values. code: exit code; None while it runs, and where nobody saw it end.
    """

    command: str
    words: tuple[str, ...]
    out: str
    process: int
    began: float  # s since the epoch
    running: bool
    code: int | None
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def state(self) -> str:
        """running, finished, stopped, failed, or ended (when no server saw it)."""
        if self.running:
            return "running"
        if self.code is None:
            return "ended"
        return "finished" if self.code in (0, NOT_MET) else "stopped" if self.code == INTERRUPTED else "failed"


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def last_job(project: Path) -> Job | None:
    """What was started last in the folder of a project; None where nothing was."""
    folder = project / HIDDEN
    record = _json(folder / RECORD)
    if not isinstance(record, dict):
        return None
    running = is_held(folder / LOCK)
    ended = None if running else _json(folder / ENDED)
    code = ended["code"] if isinstance(ended, dict) else None
    if code is None and not running and _json(folder / OUTPUT) is not None:
        code = 0  # it wrote its whole result, although no server was there to see it end
    words = tuple(record["words"])
    return Job(
        record["command"], words, record["out"], record["process"], record["began"], running, code, record["about"]
    )


_STARTING = threading.Lock()


def start(project: Path, command: str, words: Sequence[str], out: str, about: Mapping[str, Any]) -> Job:
    """Start `smajax COMMAND WORDS --out OUT --json` in the project's folder. Raises JobError while another one runs there."""
    folder = project / HIDDEN
    with _STARTING:
        folder.mkdir(exist_ok=True)
        if is_held(folder / LOCK):
            raise JobError("something is running in this folder already: stop it, or wait until it has ended")
        for name in (ENDED, OUTPUT, EVENTS):
            (folder / name).unlink(missing_ok=True)
        with (folder / EVENTS).open("wb") as events, (folder / OUTPUT).open("wb") as output:
            try:
                process = started(
                    [*PROGRAM, command, *words, "--out", out, "--json"],
                    folder / LOCK,
                    cwd=project,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=events,
                    env={**os.environ, "SMAJAX_PROGRESS": "json"},
                )
            except OSError as error:
                raise JobError(f"`smajax {command}` could not be started: {error}") from None
        record = {
            "command": command,
            "words": list(words),
            "out": out,
            "process": process.pid,
            "began": clock.time(),
            "about": dict(about),
        }
        replace(folder / RECORD, json_text(record))
    threading.Thread(target=_wait, args=(process, folder), daemon=True).start()
    job = last_job(project)
    assert job is not None
    return job


def _wait(process: subprocess.Popen[bytes], folder: Path) -> None:
    """Record how it ended, for whoever looks later."""
    code = process.wait()
    record = _json(folder / RECORD)
    if isinstance(record, dict) and record["process"] == process.pid:
        replace(folder / ENDED, json_text({"code": code}))


def stop(project: Path) -> bool:
    """Do what Ctrl-C in a terminal does, to the command and to what it has started; whether anything was running."""
    job = last_job(project)
    if job is None or not job.running:
        return False
    return interrupt(job.process)


def output_of(project: Path) -> Any:
    """The record that the last job wrote at its end; None where it wrote none."""
    return _json(project / HIDDEN / OUTPUT)
