"""How fast this machine is, in under a minute: the arm in many variants by `run_batch`, and a few of them by scipy's LSODA.

Both integrate the same trajectories: the arm lifted from rest by a constant voltage for 10 s, voltage and payload from a
box in which it meets no stop. LSODA has the explicit equations (`benchmark_arm`) and the loosest tolerance at which the
angle is right to 0.05 degrees on this problem. The whole comparison, with exact solutions, diffrax and C++, is
`python -m studies.benchmarks.run` of the repository.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from smajax.cli import benchmark_arm
from smajax.core.machine import machine
from smajax.core.operating_system import available_cores
from smajax.core.parameters import parameter_values
from smajax.core.progress import Progress, Stage, quiet
from smajax.model.rigs import arm
from smajax.simulation.batch.axes import sampled, zipped
from smajax.simulation.batch.run_batch import run_batch
from smajax.simulation.measures import Last

SECONDS, SAMPLE = 10.0, 0.05
VOLTAGES, PAYLOADS = (5.5, 8.5), (0.8, 0.95)  # V; of the preset's
TOLERANCE = 3e-4  # of our steps: right to 0.03 degrees
LSODA_TOLERANCE = 3e-6  # right to 0.05 degrees; 1e-5 is not
REPEATS = 3
AGREE = 0.1  # degrees: both errors together


def _lsoda(p: dict[str, float], voltage: float, payload: float, at: np.ndarray) -> np.ndarray:
    """Angle (degrees) at the times `at` of one member."""
    from scipy.integrate import solve_ivp

    def slope(_: float, state: np.ndarray) -> benchmark_arm.State:
        a, b, c, d, e = state.tolist()
        return benchmark_arm.rates(benchmark_arm.Floats, p, voltage, payload, (a, b, c, d, e))

    first = benchmark_arm.start(benchmark_arm.Floats, p, payload)
    result = solve_ivp(slope, (0.0, SECONDS), first, "LSODA", t_eval=at, rtol=LSODA_TOLERANCE, atol=LSODA_TOLERANCE)
    return np.degrees(result.y[2])


def benchmark(count: int = 8192, peers: int = 16, progress: Progress = quiet) -> dict[str, Any]:
    """Milliseconds a trajectory of both, their ratio, and by how many degrees they differ on the `peers` first members."""
    system = arm()
    p = parameter_values(system)
    masses = (PAYLOADS[0] * p["payload_mass"], PAYLOADS[1] * p["payload_mass"])
    axes = sampled(count, voltage=VOLTAGES, payload_mass=masses, seed=0)
    measures = (Last("position"), Last("martensite_fraction"))
    settings: dict[str, Any] = {"seconds": SECONDS, "dt": SAMPLE, "tolerance": TOLERANCE}

    def once() -> float:
        begin = time.perf_counter()
        run_batch(system, {}, axes, keep=(), measures=measures, **settings)
        return time.perf_counter() - begin

    first = once()
    progress(Stage("smajax", 0.4))
    best = min(once() for _ in range(REPEATS))
    progress(Stage("smajax", 1.0))
    box = axes.runs(0, peers)
    own = run_batch(system, {}, zipped(box), keep=("position",), **settings)["position"].to_numpy()
    times = np.arange(own.shape[-1]) * SAMPLE
    others, began = [], time.perf_counter()
    for number in range(peers):
        others.append(_lsoda(p, float(box["voltage"][number]), float(box["payload_mass"][number]), times))
        progress(Stage("scipy", (number + 1) / peers))
    each = (time.perf_counter() - began) / peers
    apart = float(np.abs(np.degrees(own) - np.asarray(others)).max())
    return {
        "machine": machine(),
        "trajectories": {"seconds": SECONDS, "smajax": count, "scipy": peers},
        "smajax_ms": 1e3 * best / count,
        "smajax_cores": available_cores(),
        "smajax_first_call_s": first,
        "scipy_ms": 1e3 * each,
        "scipy_cores": 1,
        "ratio": each * count / best,
        "ratio_per_core": each * count / best / available_cores(),
        "largest_difference_degrees": apart,
        "agree": apart < AGREE,
    }
