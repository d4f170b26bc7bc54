"""Time of one call of `receding_horizon` as exported C, beside other controllers: `python -m studies.receding_horizon.run`.

Each call of closed loops of the package is made again in C at the same readings and timed by itself, with its filter. Into results.json and the table of README.md.
"""

from __future__ import annotations

import ctypes
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from smajax.core.runtime import prepare

prepare()

from smajax.control.closed_loop import simulate_closed_loop  # noqa: E402
from smajax.control.loop_around import loop_around  # noqa: E402
from smajax.control.reference import clock, steps  # noqa: E402
from smajax.core.files import json_text, replace  # noqa: E402
from smajax.core.operating_system import processor_name  # noqa: E402
from smajax.engine import program  # noqa: E402
from smajax.export.single_precision import DOUBLE  # noqa: E402
from smajax.model.rigs import arm  # noqa: E402
from studies.exported_code.built import library  # noqa: E402
from studies.exported_code.run import source_of  # noqa: E402
from studies.marked import put  # noqa: E402

HERE = Path(__file__).parent
MARK = "<!-- table -->"
PERIOD, SECONDS = 0.01, 10.0
REPEATS = 5  # the least of so many is the time of a call: what else runs on the machine does not count
FILTER = "adaptive"
CONTROLLERS = ("receding_horizon", "backstepping1_integral")
SET_POINTS = (-0.4, 1.2, 0.3, -0.2, 0.9)  # rad, 2 s each: up, down, and inside of the hysteresis
DRIVER = """
#include <time.h>
void timed(long samples, const double *readings, const double *points, double *commands, double *seconds);
void timed(long samples, const double *readings, const double *points, double *commands, double *seconds)
{{
    {0}_state state;
    {0}_init(&state);
    for (long k = 0; k < samples; k++) {{
        struct timespec begin, end;
        clock_gettime(CLOCK_MONOTONIC, &begin);
        commands[k] = {0}_step(&state, ({0}_real)readings[k], ({0}_real)points[k]);
        clock_gettime(CLOCK_MONOTONIC, &end);
        seconds[k] = (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
    }}
}}
"""
# Before the C: ISO C alone does not declare the clock.
CLOCK = "#define _POSIX_C_SOURCE 199309L\n"


def measured(name: str) -> dict[str, Any]:
    """Median, 99th percentile and worst time of a call, s, and how far the C's commands are from the package's."""
    loop = loop_around(arm(), name, estimator=FILTER)
    time = clock(SECONDS, PERIOD)
    wanted = steps(time, SET_POINTS, SECONDS / len(SET_POINTS))

    def simulated(loop: Any, _: Any) -> tuple[Any, Any]:
        run = simulate_closed_loop(loop.system, loop.controller, wanted, PERIOD, estimator=loop.estimator)
        return run.run.reading, run.voltage

    made = program(simulated, loop, ("number",), alone=True, engine="native")
    readings, expected = (np.asarray(one)[0, :-1] for one in made(loop, {"number": np.zeros(1)}, 1))
    source = source_of(loop, name)
    timed = library(dataclasses.replace(source, source=CLOCK + source.source), DOUBLE, DRIVER).timed
    points = np.asarray(wanted.position)[:-1].copy()
    spent, commands = np.full((REPEATS, readings.size), np.inf), np.empty(readings.size)
    pointer = lambda one: one.ctypes.data_as(ctypes.c_void_p)  # noqa: E731
    for one in spent:
        timed(ctypes.c_long(readings.size), *map(pointer, (readings, points, commands, one)))
    least = spent.min(axis=0)
    return {
        "filter": FILTER,
        "calls": int(readings.size),
        "median_s": float(np.median(least)),
        "percentile_99_s": float(np.percentile(least, 99.0)),
        "worst_s": float(least.max()),
        "worst_of_all_repeats_s": float(spent.max()),
        "largest_difference_V": float(np.abs(commands - expected).max()),
        "state_bytes": int(source.state_bytes[DOUBLE]),
        "source_bytes": len(source.source),
    }


def table(results: dict[str, Any]) -> str:
    """A row a controller."""
    head = ["controller with its filter", "median, µs", "99th percentile, µs", "worst call, µs"]
    head += ["worst of all repeats, µs", "period over worst", "state, bytes", "source, kB"]
    rows = [head, ["---"] * len(head)]
    for name, one in results["controllers"].items():
        micro = [1e6 * one[key] for key in ("median_s", "percentile_99_s", "worst_s", "worst_of_all_repeats_s")]
        share = results["period_s"] / one["worst_s"]
        cells = [f"{name}, `{one['filter']}`", *(f"{value:.3g}" for value in micro), f"{share:.0f}"]
        rows.append([*cells, f"{one['state_bytes']}", f"{one['source_bytes'] / 1000:.0f}"])
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def main() -> None:
    """Measure and write."""
    results: dict[str, Any] = {"processor": processor_name(), "period_s": PERIOD, "controllers": {}}
    for name in CONTROLLERS:
        results["controllers"][name] = measured(name)
        print(name, json.dumps(results["controllers"][name]), flush=True)
    replace(HERE / "results.json", json_text(results))
    page = HERE / "README.md"
    replace(page, put(page.read_text(encoding="utf-8"), MARK, table(results)))


if __name__ == "__main__":
    main()
