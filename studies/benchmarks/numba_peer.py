"""numba on the arm, the scheme and the steps of `arm.cpp`: `python -m studies.benchmarks.numba_peer FILE`; prints JSON.

Runs in an environment of its own with numpy and numba, from the folder that has `studies`. What is timed: all members to
their end over all cores, in blocks of a fixed number of lanes, the best number of `LANES`; the compilation apart.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from studies.benchmarks.given import Given, load
from studies.benchmarks.numba_arm import COLUMNS, Tools, build, members_of, rig_of

LANES = (64, 128)
PRECISIONS = {"double": np.float64, "float": np.float32}
REPEATS = 3


def tools() -> Tools:
    """numba's decorators; without checks of a division, which would make a jump of each."""
    import numba

    record = {"fastmath": True, "error_model": "numpy"}
    return Tools(
        numba.njit(forceinline=True, **record), numba.njit(**record), numba.njit(parallel=True, **record), numba.prange
    )


def simulated(
    given: Given,
    simulate: Callable[..., int],
    real: Any,
    lanes: int,
    count: int,
    dt: float,
    every: int | None = None,
) -> tuple[np.ndarray, np.ndarray, int]:
    """(result of shape (count, COLUMNS), record of shape (samples, count, 2), iterations) of the first `count` members.

    `every`: how many steps of `dt` s lie between two samples of the record; None keeps no sample.
    """
    steps, whole = round(given.seconds / dt), -(-count // lanes) * lanes
    voltage, payload = np.resize(given.voltage, whole), np.resize(given.payload_mass, whole)
    # The last block is filled up.
    own = members_of(given.constants, dt, voltage, payload).astype(real)
    recorded = 0 if every is None else count
    every = steps if every is None else every
    record, result = np.empty((steps // every + 1, recorded, 2), real), np.empty((whole, COLUMNS), real)
    iterations = simulate(rig_of(given.constants, dt, real), own, steps, every, record, result)
    return result[:count], record, int(iterations)


def errors(given: Given, simulate: Callable[..., int], real: Any, lanes: int, dt: float) -> tuple[float, float]:
    """Largest errors of the angle, degrees, and of the fraction over the solved members."""
    every = round(float(given.times[1]) / dt)
    _, record, _ = simulated(given, simulate, real, lanes, given.solved, dt, every)
    return given.errors(np.degrees(record[..., 0].astype(float)).T, record[..., 1].astype(float).T)


def _timed(given: Given, real: Any, lanes: int, count: int, dt: float) -> dict[str, Any]:
    simulate = build(real, lanes, tools())
    begin = time.perf_counter()
    off = errors(given, simulate, real, lanes, dt)
    first = time.perf_counter() - begin
    begin = time.perf_counter()
    errors(given, simulate, real, lanes, dt)
    compiled = first - (time.perf_counter() - begin)
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        _, _, iterations = simulated(given, simulate, real, lanes, count, dt)
        times.append(time.perf_counter() - begin)
    stages = 2 * round(given.seconds / dt) * -(-count // lanes)
    return {
        "lanes": lanes,
        "members": count,
        "ms_per_trajectory": 1e3 * min(times) / count,
        "angle_error": off[0],
        "fraction_error": off[1],
        "accurate": given.meets(off),
        "iterations_per_stage": iterations / stages,
        "compile_s": compiled,
    }


def run(given: Given, count: int, dt: float) -> dict[str, Any]:
    """Both precisions, each at its fastest number of lanes."""
    import numba

    record: dict[str, Any] = {
        "peer": "numba",
        "versions": {name: version(name) for name in ("numba", "llvmlite", "numpy")},
        "dt": dt,
        "cores": numba.get_num_threads(),
    }
    for name, real in PRECISIONS.items():
        # The fastest number is found on a part of the runs; that one is timed in full.
        tried = [_timed(given, real, lanes, max(count // 8, lanes), dt) for lanes in LANES]
        best = min(tried, key=lambda one: float(one["ms_per_trajectory"]))
        record[name] = _timed(given, real, best["lanes"], count, dt)
        # kB on Linux: of the whole process, the interpreter and the compiler with it.
        record[name] |= {"tried": tried, "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3}
    return record


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=65536, help="members that are timed")
    parser.add_argument("--dt", type=float, default=0.005, help="s")
    parser.add_argument("--cores", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    # Before numba is imported.
    os.environ["NUMBA_NUM_THREADS"] = str(options.cores)
    print(json.dumps(run(load(options.file), options.count, options.dt)))


if __name__ == "__main__":
    main()
