"""Many members streamed to a store: `python -m studies.benchmarks.scale --count N`; prints time and peak memory as JSON."""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from smajax.core.operating_system import peak_memory
from smajax.core.runtime import prepare
from smajax.model.rigs import arm
from smajax.simulation.batch.run_batch import run_batch
from studies.benchmarks import problem
from studies.benchmarks.single import TOLERANCE
from studies.benchmarks.throughput import MEASURES


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10**4)
    parser.add_argument("--seconds", type=float, default=problem.SECONDS)
    options = parser.parse_args()
    prepare(cores=True)
    before = peak_memory()
    with tempfile.TemporaryDirectory() as place:
        begin = time.perf_counter()
        run_batch(
            arm(),
            {},
            problem.axes(options.count),
            seconds=options.seconds,
            dt=problem.EVERY,
            tolerance=TOLERANCE,
            keep=(),
            measures=MEASURES,
            out=Path(place) / "batch",
        )
        took = time.perf_counter() - begin
        size = sum(file.stat().st_size for file in Path(place).rglob("*") if file.is_file())
    record = {"peer": "scale", "members": options.count, "s": took, "ms_per_trajectory": 1e3 * took / options.count}
    print(
        json.dumps(
            {**record, "peak_memory_MB": peak_memory() / 1e6, "imports_MB": before / 1e6, "store_MB": size / 1e6}
        )
    )


if __name__ == "__main__":
    main()
