"""One trajectory, and the first call of a fresh process: `python -m studies.benchmarks.single FILE`; prints JSON.

`simulate_compiled` with steps of its own, its trajectory at samples of 50 ms; `xla_ms` is `jit` of `simulate` with fixed ones.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax

from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from smajax.model.types import Trajectory
from smajax.simulation.compiled import simulate_compiled
from smajax.simulation.simulate import DEFAULT_STEP, simulate
from studies.benchmarks import problem
from studies.benchmarks.given import load

REPEATS = 10
TOLERANCE = 3e-4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    given = load(parser.parse_args().file)
    prepare()
    jax.config.update("jax_enable_compilation_cache", False)
    run, system, volts = eqx.filter_jit(simulate), arm(), float(given.voltage[0])
    few, many = ({"voltage": problem.held(volts, dt)} for dt in (problem.EVERY, DEFAULT_STEP))

    def timed(simulated: Callable[[], Trajectory]) -> float:
        begin = time.perf_counter()
        jax.block_until_ready(simulated().position)
        return time.perf_counter() - begin

    own, fixed = (
        (lambda: simulate_compiled(system, few, problem.EVERY, TOLERANCE)),
        (lambda: run(system, many, DEFAULT_STEP)),
    )
    first, first_xla = timed(own), timed(fixed)
    record = {"peer": "single", "first_call_s": first, "ms": 1e3 * min(timed(own) for _ in range(REPEATS))}
    record |= {"xla_first_call_s": first_xla, "xla_ms": 1e3 * min(timed(fixed) for _ in range(REPEATS))}
    print(json.dumps(record))


if __name__ == "__main__":
    main()
