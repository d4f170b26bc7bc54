"""Measures what docs and claims say of exported code: `python -m studies.exported_code.run [--loops N]`, into results.json beside it."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.core.runtime import prepare

prepare()

from smajax.control.closed_loop import simulate_closed_loop  # noqa: E402
from smajax.control.loop_around import loop_around  # noqa: E402
from smajax.control.loop_dataset import Loop  # noqa: E402
from smajax.control.presets import CONTROLLERS  # noqa: E402
from smajax.core.files import json_text, replace  # noqa: E402
from smajax.core.parameters import set_parameters  # noqa: E402
from smajax.engine import program  # noqa: E402
from smajax.export.compiled import DOUBLE, SINGLE  # noqa: E402
from smajax.export.controller import SHORT, controller_block  # noqa: E402
from smajax.export.from_files import plant_source  # noqa: E402
from smajax.export.source import CSource, c_source  # noqa: E402
from smajax.model.rigs import arm, dead_weight  # noqa: E402
from smajax.simulation.compiled import simulate_compiled  # noqa: E402
from studies.exported_code.built import commands, open_loop  # noqa: E402
from studies.source.unloading import INITIAL_MASS, VOLTS  # noqa: E402

PERIOD, SAMPLES = 0.01, 201
CASES = [
    ("pid", ""),
    ("vsc1", ""),
    ("vsc2", ""),
    ("vsc3", ""),
    ("nvsc", "printed"),
    ("sld", "printed"),
    ("backstepping1", "printed"),
    ("backstepping2", "printed"),
    ("pid", "model"),
    ("sld", "model"),
]
RESULTS = Path(__file__).with_name("results.json")


def source_of(loop: Loop, name: str) -> CSource:
    known = CONTROLLERS[name].known
    return c_source(
        lambda: controller_block(loop.system, loop.controller, loop.estimator, PERIOD, 0, "own", known), "own", SHORT
    )


def closed_loops(name: str, estimator: str, count: int) -> dict[str, Any]:
    """Loops of the package with another set point and payload each, on machine code, and the C at the same readings."""
    loop = loop_around(arm(), name, estimator=estimator or None)
    source = source_of(loop, name)

    def one(loop: Loop, own: dict[str, Any]) -> tuple[Any, Any]:
        plant = set_parameters(loop.system, {"payload_mass": own["payload"]})
        wanted = jnp.full(SAMPLES, own["point"])
        found = simulate_closed_loop(plant, loop.controller, wanted, PERIOD, estimator=loop.estimator)
        return found.run.reading, found.voltage

    random = np.random.default_rng(0)
    own = {"point": random.uniform(-0.7, 1.4, count), "payload": random.uniform(0.03, 0.09, count)}
    run = program(one, loop, ("point", "payload"))
    run(loop, {key: values[:8] for key, values in own.items()})  # compiled
    begin = time.perf_counter()
    readings, voltage = (np.asarray(series)[:, :-1] for series in run(loop, own))
    package = time.perf_counter() - begin
    points = np.repeat(own["point"][:, None], readings.shape[1], axis=1)
    result: dict[str, Any] = {
        "controller": name,
        "estimator": estimator,
        "loops": count,
        "samples": int(voltage.size),
        "operations": source.operations["step"],
        "package_loop_seconds": package,
    }
    largest = float(np.max(np.abs(voltage)))
    for kind in (DOUBLE, SINGLE):
        begin = time.perf_counter()
        found = commands(source, kind, readings, points)
        off = np.max(np.abs(found - voltage), axis=1) / largest
        result[kind] = {
            "state_bytes": source.state_bytes[kind],
            "seconds_with_compilation": time.perf_counter() - begin,
            "largest": float(np.max(off)),
            "median": float(np.median(off)),
            "loops_within": float(np.mean(off < (1e-9 if kind == DOUBLE else 1e-5))),
        }
    return result


def open_loops() -> list[dict[str, Any]]:
    """The arm of M2 and M3, and the weights of M13, by the package and in C, which steps by 1, 5 and 50 ms."""
    mass = np.full(16_001, INITIAL_MASS)  # 40 s, 20 s with 96 g less, 20 s
    mass[8_000:12_000] -= 0.096
    cases = {
        "M2": (arm(), {"voltage": np.full(2001, 7.2)}),
        "M3": (arm(), {"voltage": np.full(2001, 7.3)}),
        "M13": (dead_weight(), {"voltage": np.full(16_001, VOLTS), "mass": mass}),
    }
    rows = []
    for name, (system, inputs) in cases.items():
        source, tolerance = plant_source(system), 1e-5
        series = {key: jnp.asarray(values) for key, values in inputs.items()}
        begin = time.perf_counter()
        run = simulate_compiled(system, series, 0.005, tolerance=tolerance)
        begin = time.perf_counter()
        run = simulate_compiled(system, series, 0.005, tolerance=tolerance)
        package = time.perf_counter() - begin
        exact = simulate_compiled(system, series, 0.005, tolerance=1e-8)
        way = float(np.ptp(exact.reading))
        row: dict[str, Any] = {"case": name, "range": way, "package_error": _off(run.reading, exact.reading)}
        row["package_seconds_a_step"] = package / (len(exact.reading) - 1)
        for seconds, stride in ((0.001, 5), (0.005, 1), (0.05, 10)):
            finer = seconds < 0.005
            given = {
                key: np.append(np.repeat(values[:-1], stride), values[-1]) if finer else values[::stride]
                for key, values in inputs.items()
            }
            outputs, spent = open_loop(source, given, seconds)
            found = outputs["reading"]
            ours, theirs = (found[::stride], exact.reading) if finer else (found, exact.reading[::stride])
            row[f"error_at_{1e3 * seconds:g}_ms"] = _off(ours, theirs)
            row[f"seconds_a_step_of_{1e3 * seconds:g}_ms"] = spent / (len(found) - 1)
            row[f"from_package_at_{1e3 * seconds:g}_ms"] = _off(ours, run.reading if finer else run.reading[::stride])
        rows.append(row)
    return rows


def _off(ours: Any, theirs: Any) -> float:
    return float(np.max(np.abs(np.asarray(ours) - np.asarray(theirs))))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--loops", type=int, default=10_000)
    given = parser.parse_args()
    result: dict[str, Any] = {"open_loops": open_loops(), "closed_loops": []}
    replace(RESULTS, json_text(result))
    for name, estimator in CASES:
        result["closed_loops"].append(closed_loops(name, estimator, given.loops))
        print(json.dumps(result["closed_loops"][-1]), flush=True)
        replace(RESULTS, json_text(result))


if __name__ == "__main__":
    main()
