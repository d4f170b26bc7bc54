"""One trajectory, and the first call of a fresh process: `python -m studies.benchmarks.single FILE`; prints JSON."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import equinox as eqx
import jax

from smajax.figures.rigs import arm
from smajax.runtime import prepare
from smajax.simulate import DEFAULT_STEP, simulate
from studies.benchmarks import problem
from studies.benchmarks.given import load

REPEATS = 10


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("file", type=Path)
    given = load(asked.parse_args().file)
    prepare()
    jax.config.update("jax_enable_compilation_cache", False)
    run = eqx.filter_jit(simulate)
    inputs = {"voltage": problem.held(float(given.voltage[0]), DEFAULT_STEP)}

    def once() -> float:
        begin = time.perf_counter()
        jax.block_until_ready(run(arm(), inputs, DEFAULT_STEP).position)
        return time.perf_counter() - begin

    first = once()
    print(json.dumps({"peer": "single", "first_call_s": first, "ms": 1e3 * min(once() for _ in range(REPEATS))}))


if __name__ == "__main__":
    main()
