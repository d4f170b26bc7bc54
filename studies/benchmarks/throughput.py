"""smajax on the problem of the peers, every core: `python -m studies.benchmarks.throughput FILE`; prints JSON.

With the default step, or with `--tolerance` and samples `--dt` apart, between which it takes steps of its own; that it is accurate enough is checked on the solved
members. What is timed is `run_batch`
as a user calls it, measures of each run and no trajectory, the compilation apart.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from smajax.core.operating_system import available_cores, peak_memory
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Last
from smajax.simulation.simulate import DEFAULT_STEP
from studies.benchmarks import problem
from studies.benchmarks.given import Given, load

MEASURES = (Last("position"), Last("martensite_fraction"))
REPEATS = 3


def _errors(given: Given, dt: float, tolerance: float | None) -> tuple[float, float]:
    axes = zipped(problem.axes(len(given.voltage)).runs(0, given.solved))
    every = max(1, round(problem.EVERY / dt))
    keep = ("position", "martensite_fraction")
    result = run_batch(arm(), {}, axes, seconds=given.seconds, dt=dt, every=every, keep=keep, tolerance=tolerance)
    compared = max(1, round(dt / problem.EVERY))
    return given.errors(np.degrees(result["position"].to_numpy()), result["martensite_fraction"].to_numpy(), compared)


def run(given: Given, dt: float, tolerance: float | None, count: int) -> dict[str, Any]:
    """Errors at a step of `dt`, or at a tolerance, and the time of `count` members."""
    off = _errors(given, dt, tolerance)
    axes = problem.axes(count)

    def once() -> float:
        begin = time.perf_counter()
        run_batch(arm(), {}, axes, seconds=given.seconds, dt=dt, keep=(), measures=MEASURES, tolerance=tolerance)
        return time.perf_counter() - begin

    first, times = once(), [once() for _ in range(REPEATS)]
    best = min(times)
    return {
        "peer": "smajax" if tolerance is None else "smajax, own steps",
        "precision": str(jax.numpy.zeros(()).dtype),
        "dt": dt,
        "tolerance": tolerance,
        "angle_error": off[0],
        "fraction_error": off[1],
        "accurate": given.meets(off),
        "members": count,
        "cores": available_cores(),
        "ms_per_trajectory": 1e3 * best / count,
        "compile_s": first - best,
        "peak_memory_MB": peak_memory() / 1e6,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=65536)
    parser.add_argument("--dt", type=float, default=DEFAULT_STEP)
    parser.add_argument("--tolerance", type=float)
    parser.add_argument("--single-precision", action="store_true")
    options = parser.parse_args()
    prepare(cores=True)
    jax.config.update("jax_enable_compilation_cache", False)  # so that compiling is seen
    if options.single_precision:
        jax.config.update("jax_enable_x64", False)
    print(json.dumps(run(load(options.file), options.dt, options.tolerance, options.count)))


if __name__ == "__main__":
    main()
