"""Builds and runs `arm.cpp`, the integrator's scheme for the rotary arm written by hand: the bar that smajax is held to."""

from __future__ import annotations

import json
import platform
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from smajax.core.parameters import get_parameters, parameters
from smajax.model.system import System

SOURCE = Path(__file__).with_name("arm.cpp")
MISSING = "there is no g++ here (clang under its name does not count: its OpenMP is a matter of luck)"
FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp", "-std=c++17")
# Vectors as wide as the machine's: by itself the compiler takes half of that where it has 512 bits.
WIDE = ("-mprefer-vector-width=512",)
PRECISIONS = ("double", "float")


@dataclass(frozen=True)
class Result:
    """What a run of the C++ program left: arrays of one number a member, SI, temperatures in C."""

    seconds: float  # of the computation alone, best of the repeats
    processor_seconds: float  # of all threads together: what it takes whatever else the machine is busy with
    iterations_per_stage: float  # that a block of members needed on average
    final_angle: np.ndarray  # rad
    largest_angle: np.ndarray  # rad
    smallest_fraction: np.ndarray  # -
    final_temperature: np.ndarray  # C
    angle: np.ndarray  # rad, (samples, members) of the record; empty without one
    fraction: np.ndarray  # -, likewise


def build(folder: Path, flags: tuple[str, ...] = ()) -> Path | None:
    """The compiled program in `folder`, with further `flags`; None where there is no g++ (`MISSING` says so).

    RuntimeError with the compiler's words where it refuses.
    """
    compiler = shutil.which("g++")
    if compiler is None or "clang" in subprocess.run([compiler, "--version"], capture_output=True, text=True).stdout:
        return None
    program = folder / "arm"
    wide = WIDE if platform.machine() in ("x86_64", "AMD64") else ()
    done = subprocess.run(
        [compiler, *FLAGS, *wide, *flags, "-o", str(program), str(SOURCE)], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise RuntimeError(f"g++ does not compile {SOURCE.name}: {done.stderr}")
    return program


# More than eight parameters: each is one option of the C++ program.
def run(
    program: Path,
    system: System,
    runs: np.ndarray,
    dt: float,
    steps: int,
    threads: int = 1,
    precision: str = "double",
    repeats: int = 1,
    every: int = 1,
    recorded: int = 0,
) -> Result:
    """Simulate `runs`, rows of (voltage in V, payload mass in kg), over `steps` of `dt` s.

    `system` is `smajax.model.rigs.arm()` with any parameters; `precision` is "double" or "float". Of the first
    `recorded` members every `every`-th sample comes back, the first one included.
    """
    if precision not in PRECISIONS:
        raise ValueError(f"`precision` must be one of {PRECISIONS}, not {precision!r}.")
    names = sorted(parameters(system))
    values = np.asarray(get_parameters(system, names), dtype=float)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        lines = [f"{name} {float(value)!r}" for name, value in zip(names, values, strict=True)]
        (folder / "parameters").write_text("\n".join(lines) + "\n")
        np.ascontiguousarray(runs, dtype=np.float64).tofile(folder / "members")
        options = {
            "dt": repr(dt),
            "steps": steps,
            "threads": threads,
            "precision": precision,
            "repeats": repeats,
            "record": folder / "record",
            "every": every,
            "first": recorded,
        }
        words = [str(word) for name, value in options.items() for word in (f"--{name}", value)]
        files = [str(folder / name) for name in ("parameters", "members", "result")]
        done = subprocess.run([str(program), *files, *words], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{program.name} failed: {done.stderr}")
        said = json.loads(done.stdout)
        ends = np.fromfile(folder / "result").reshape(-1, 4)
        record = np.fromfile(folder / "record").reshape(steps // every + 1, min(recorded, len(runs)), 2)
    angle, largest, smallest, temperature = ends.T
    return Result(
        seconds=said["seconds"],
        processor_seconds=said["processor_seconds"],
        iterations_per_stage=said["iterations_per_stage"],
        final_angle=angle,
        largest_angle=largest,
        smallest_fraction=smallest,
        final_temperature=temperature,
        angle=record[..., 0],
        fraction=record[..., 1],
    )
