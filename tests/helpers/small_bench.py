"""A small experiment of a weight on a heated wire as files, and a command of smajax run on it within the test's process."""

from __future__ import annotations

import contextlib
import io
import sys
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np

from smajax.cli.main import main

BENCH = """\
title = "Bench"
[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
[unknown]
convection_coefficient = { low = "40 W/m^2/K", high = "400 W/m^2/K", start = "100 W/m^2/K" }
[sampling]
step = "100 ms"
[time]
column = "t"
unit = "s"
[channels.voltage]
role = "input"
column = "U"
unit = "V"
[channels.position]
role = "output"
column = "x"
unit = "mm"
noise = "0.1 mm"
[[runs]]
name = "A"
role = "fit"
file = "a.csv"
[[runs]]
name = "B"
role = "held-out"
file = "b.csv"
"""


def log(
    path: Path, seconds: float = 20.0, interval: float = 0.05, top: float = 5.0, stroke: float = 18.0, seed: int = 0
) -> Path:
    """A made-up log with the headings t (s), U (V), x (mm): on for half of the time, then off; the wire follows in 1.5 s."""
    t = np.arange(0.0, seconds, interval)
    u = np.where(t < 0.5 * seconds, top, 0.0)
    up = 1.0 - np.exp(-t / 1.5)
    x = stroke * np.where(t < 0.5 * seconds, up, (1.0 - np.exp(-seconds / 3.0)) * np.exp(-(t - 0.5 * seconds) / 1.5))
    x = x + np.random.default_rng(seed).normal(0.0, 0.1, t.size)
    return table(path, t, u, x)


def table(path: Path, t: np.ndarray, u: np.ndarray, x: np.ndarray, heading: str = "t,U,x") -> Path:
    np.savetxt(path, np.stack([t, u, x], axis=1), delimiter=",", header=heading, comments="", fmt="%.6g")
    return path


def bench(folder: Path, *changes: tuple[str, str]) -> Path:
    """experiment.toml and its two logs in `folder`, with each old text replaced by the new; the path of the former."""
    folder.mkdir(parents=True, exist_ok=True)
    text = BENCH
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    log(folder / "a.csv")
    log(folder / "b.csv", seconds=16.0, top=4.5, seed=1)
    return folder / "experiment.toml"


@dataclass(frozen=True)
class Ended:
    """A command that has ended: its exit code, stdout, and stderr with the line breaks of a narrow terminal taken out."""

    code: int
    out: str
    said: str


def smajax(*words: str | Path) -> Ended:
    """The command as a person gives it; an exception that gets through is a traceback to that person, and fails the test."""
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    with (
        patch("smajax.core.runtime.prepare", lambda cores=False: None),  # done for all tests, and cannot be done twice
        patch.object(sys, "argv", ["smajax", *map(str, words)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code
    said = " ".join(err.getvalue().replace("│", " ").split())
    return Ended(code if isinstance(code, int) else int(code is not None), out.getvalue(), said)


def refused(*words: str | Path) -> str:
    """What a command that cannot be done says: one message on stderr, exit code 2, no traceback, nothing on stdout."""
    ended = smajax(*words)
    assert ended.code == 2, (ended.code, ended.out, ended.said)
    assert "Traceback" not in ended.said
    assert ended.out == ""
    return ended.said
