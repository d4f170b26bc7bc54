"""The C of a block as a library of this machine, driven over whole series by a few lines of C beside it."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from smajax.export.compiled import DOUBLE
from smajax.export.source import CSource

FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "-fPIC", "-shared")

# Of a controller: series of readings and set points, one row a loop -> its commands. Of a model: inputs held for `seconds`.
CONTROLLER = """
void drive(long loops, long samples, const double *readings, const double *points, double *commands);
void drive(long loops, long samples, const double *readings, const double *points, double *commands)
{{
    for (long loop = 0; loop < loops; loop++) {{
        {0}_state state;
        {0}_init(&state);
        for (long k = loop * samples; k < (loop + 1) * samples; k++) {{
            commands[k] = {0}_step(&state, (real)readings[k], (real)points[k]);
        }}
    }}
}}
"""
MODEL = """
void drive(long samples, const {0}_inputs *inputs, {0}_outputs *outputs, double seconds);
void drive(long samples, const {0}_inputs *inputs, {0}_outputs *outputs, double seconds)
{{
    {0}_state state;
    {0}_init(&state);
    {0}_start(&state, &inputs[0], &outputs[0]);
    for (long k = 0; k + 1 < samples; k++) {{
        {0}_run(&state, &inputs[k], &outputs[k + 1], (real)seconds);
    }}
}}
"""


def library(source: CSource, kind: str, driver: str) -> ctypes.CDLL:
    """Compiled with every warning an error."""
    folder = Path(tempfile.mkdtemp())
    (folder / f"{source.name}.h").write_text(source.header)
    (folder / f"{source.name}.c").write_text(source.source + driver.format(source.name))
    path = folder / f"{source.name}.so"
    macro = f"-DSMAJAX_SINGLE={int(kind != DOUBLE)}"
    subprocess.run(["gcc", *FLAGS, macro, folder / f"{source.name}.c", "-o", path, "-lm"], check=True)
    return ctypes.CDLL(str(path))


def commands(source: CSource, kind: str) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Of a controller compiled once: readings and set points -> commands, (loops, samples) each."""
    drive = library(source, kind, CONTROLLER).drive

    def of(readings: np.ndarray, points: np.ndarray) -> np.ndarray:
        given = [np.ascontiguousarray(one, dtype=np.float64) for one in (readings, points)]
        found = np.empty_like(given[0])
        pointers = [one.ctypes.data_as(ctypes.c_void_p) for one in (*given, found)]
        drive(ctypes.c_long(len(found)), ctypes.c_long(found.shape[1]), *pointers)
        return found

    return of


def open_loop(
    source: CSource, inputs: dict[str, np.ndarray], seconds: float, times: int = 1
) -> tuple[dict[str, np.ndarray], list[float]]:
    """Of a model in double precision, for inputs held from sample to sample: (outputs by name, (samples,); processor time of each run, s)."""
    samples = len(next(iter(inputs.values())))
    rows = np.stack([inputs.get(one.name, np.full(samples, one.start)) for one in source.inputs], axis=1)
    found = np.empty((samples, len(source.outputs)))
    given = [np.ascontiguousarray(rows, dtype=np.float64), found]
    pointers = [one.ctypes.data_as(ctypes.c_void_p) for one in given]
    run = library(source, DOUBLE, MODEL).drive
    spent = []
    for _ in range(times):
        begin = time.process_time()
        run(ctypes.c_long(samples), *pointers, ctypes.c_double(seconds))
        spent.append(time.process_time() - begin)
    return {one.name: found[:, k] for k, one in enumerate(source.outputs)}, spent
