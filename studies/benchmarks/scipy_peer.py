"""scipy's LSODA on the arm, one member after the other: `python -m studies.benchmarks.scipy_peer FILE`; prints JSON."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from scipy.integrate import solve_ivp

from smajax.cli import benchmark_arm as equations
from studies.benchmarks.given import Given, load

TOLERANCES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 1e-8)  # relative and absolute


def _solver(given: Given) -> Callable[[int, float, np.ndarray | None], Any]:
    p, floats = given.constants, equations.Floats

    def solve(member: int, tolerance: float, at: np.ndarray | None) -> Any:
        voltage, payload = float(given.voltage[member]), float(given.payload_mass[member])

        def slope(_: float, state: np.ndarray) -> equations.State:
            a, b, c, d, e = state.tolist()
            return equations.rates(floats, p, voltage, payload, (a, b, c, d, e))

        first = equations.start(floats, p, payload)
        span = (0.0, given.seconds)
        return solve_ivp(slope, span, first, "LSODA", t_eval=at, rtol=tolerance, atol=tolerance)

    return solve


def run(given: Given, count: int) -> dict[str, Any]:
    """The loosest tolerance that is accurate on the solved members, and the time of `count` members at it."""
    solve = _solver(given)
    tried = []
    for tolerance in TOLERANCES:
        result = np.array([solve(k, tolerance, given.times).y for k in range(given.solved)])
        xi = equations.fraction(np, given.constants, tuple(result.swapaxes(0, 1)))
        off = given.errors(np.degrees(result[:, 2]), xi)
        tried.append({"tolerance": tolerance, "angle_error": off[0], "fraction_error": off[1]})
        if given.meets(off):
            break
    else:
        return {"peer": "scipy", "reason": "no tolerance of the list is accurate enough", "tried": tried}
    begin = time.perf_counter()
    for k in range(count):
        solve(k, tolerance, np.array([given.seconds]))  # the end alone
    each = (time.perf_counter() - begin) / count
    best = {"solver": "LSODA", **tried[-1], "ms_per_trajectory": 1e3 * each, "members": count, "cores": 1}
    return {"peer": "scipy", "version": scipy.__version__, "best": best, "tried": tried}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=64, help="members that are timed")
    options = parser.parse_args()
    given = load(options.file)
    print(json.dumps(run(given, min(options.count, len(given.voltage)))))


if __name__ == "__main__":
    main()
