"""The C of a block as a library of this machine, driven over whole series by a few lines of C beside it."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from smajax.export.single_precision import DOUBLE, SINGLE
from smajax.export.source import CSource, arithmetic_macro

FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "-fPIC", "-shared")

# Of a controller: gains, series of readings and set points, one row a loop -> its commands. Of a model: inputs held for `seconds`.
CONTROLLER = """
void drive(long loops, long samples, const double *gains, const double *readings, const double *points, double *commands);
void drive(long loops, long samples, const double *gains, const double *readings, const double *points, double *commands)
{{
    for (long loop = 0; loop < loops; loop++) {{
        {0}_state state;
        {0}_number *const parameters = ({0}_number *)&state.parameters;
        const long count = (long)(sizeof state.parameters / sizeof *parameters);
        {0}_init(&state);
        for (long k = 0; k < count; k++) {{
            parameters[k] = (real)gains[loop * count + k];
        }}
        for (long k = loop * samples; k < (loop + 1) * samples; k++) {{
            commands[k] = {0}_step(&state, ({0}_real)readings[k], ({0}_real)points[k]);
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


def library(source: CSource, kind: str, driver: str, arithmetic: str = "") -> ctypes.CDLL:
    """Compiled with every warning an error. kind: of inputs and outputs; arithmetic: "" as the header has it."""
    folder = Path(tempfile.mkdtemp())
    (folder / f"{source.name}.h").write_text(source.header)
    (folder / f"{source.name}.c").write_text(source.source + driver.format(source.name))
    path = folder / f"{source.name}.so"
    macros = [f"-DSMAJAX_SINGLE={int(kind == SINGLE)}"]
    macros += [f"-D{arithmetic_macro(source.name)}={int(arithmetic == SINGLE)}"] if arithmetic else []
    subprocess.run(["gcc", *FLAGS, *macros, folder / f"{source.name}.c", "-o", path, "-lm"], check=True)
    return ctypes.CDLL(str(path))


def commands(source: CSource, kind: str, arithmetic: str = "") -> Callable[..., np.ndarray]:
    """Of a controller compiled once: readings and set points, (loops, samples) each -> commands of the same shape.

    The third argument: gains of each loop by name, (loops,) each; others are at their start values.
    """
    drive = library(source, kind, CONTROLLER, arithmetic).drive

    def of(readings: np.ndarray, points: np.ndarray, gains: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
        own = {one.name: np.full(len(readings), one.start) for one in source.parameters} | dict(gains or {})
        rows = np.stack([own[one.name] for one in source.parameters], axis=1)
        given = [np.ascontiguousarray(one, dtype=np.float64) for one in (rows, readings, points)]
        found = np.empty_like(given[1])
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
