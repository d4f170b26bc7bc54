"""Exported controllers against the package over many closed loops: `python -m studies.exported_code.run [--loops N]`.

Into results.json beside it, and what single-precision arithmetic gave into the package, which chooses by it (`smajax.export.single_precision`).
"""

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
from smajax.export.controller import SHORT, controller_block  # noqa: E402
from smajax.export.single_precision import DOUBLE, ENOUGH, RECORD, SINGLE  # noqa: E402
from smajax.export.source import CSource, c_source  # noqa: E402
from smajax.model.presets import build  # noqa: E402
from smajax.model.rigs import arm  # noqa: E402
from smajax.model.system import System  # noqa: E402
from studies.exported_code.built import commands  # noqa: E402

PERIOD, SAMPLES = 0.01, 201
GAINS, BOX = "preset", "within the bounds of tuning"
CASES = [
    ("pid", ""),
    ("vsc1", ""),
    ("vsc2", ""),
    ("vsc3", ""),
    ("feedforward_pi", ""),
    ("nvsc", "printed"),
    ("sld", "printed"),
    ("backstepping1", "printed"),
    ("backstepping2", "printed"),
    ("pid", "model"),
    ("sld", "model"),
    ("backstepping1", "model"),
    ("backstepping2", "model"),
    ("backstepping1_integral", "model"),
    ("backstepping2_integral", "model"),
    ("sld", "adaptive"),
]
RESULTS = Path(__file__).with_name("results.json")


def source_of(loop: Loop, name: str) -> CSource:
    known = CONTROLLERS[name].known
    return c_source(
        lambda: controller_block(loop.system, loop.controller, loop.estimator, PERIOD, 0, "own", known), "own", SHORT
    )


def plant_of(load: str) -> tuple[System, tuple[float, float]]:
    """(the plant, between which set points)."""
    if load == "arm":
        return arm(), (-0.7, 1.4)
    return build("flexinol_table_3_2", "bias_spring", "flexinol_voltage"), (0.0, 0.008)


def closed_loops(name: str, estimator: str, count: int, load: str = "arm", gains: str = GAINS) -> dict[str, Any]:
    """Loops of the package on machine code, and the C at the same readings.

    Each loop has a set point of its own; of preset gains on the arm a payload, else gains drawn by logarithm within the bounds of tuning.
    """
    system, (low, high) = plant_of(load)
    loop = loop_around(system, name, estimator=estimator or None)
    source = source_of(loop, name)
    box = CONTROLLERS[name].box_on(system) if gains == BOX else {}

    def one(loop: Loop, own: dict[str, Any]) -> tuple[Any, Any]:
        plant = set_parameters(loop.system, {"payload_mass": own["payload"]} if "payload" in own else {})
        tuned = set_parameters(loop.controller, {key: own[key] for key in box})
        wanted = jnp.full(SAMPLES, own["point"])
        found = simulate_closed_loop(plant, tuned, wanted, PERIOD, estimator=loop.estimator)
        return found.run.reading, found.voltage

    random = np.random.default_rng(0)
    own = {"point": random.uniform(low, high, count)}
    if not box:
        own["payload"] = random.uniform(0.03, 0.09, count)
    own |= {key: np.exp(random.uniform(np.log(ends[0]), np.log(ends[1]), count)) for key, ends in box.items()}
    run = program(one, loop, tuple(own))
    run(loop, {key: values[:8] for key, values in own.items()})  # compiled
    begin = time.perf_counter()
    readings, voltage = (np.asarray(series)[:, :-1] for series in run(loop, own))
    package = time.perf_counter() - begin
    points = np.repeat(own["point"][:, None], readings.shape[1], axis=1)
    drawn = {key: own[key] for key in box}
    result: dict[str, Any] = {
        "controller": name,
        "estimator": estimator,
        "load": load,
        "gains": gains,
        "loops": count,
        "samples": int(voltage.size),
        "operations": source.operations["step"],
        "package_loop_seconds": package,
    }
    largest = float(np.max(np.abs(voltage)))
    result["largest_command"] = largest
    rounded = [one.astype(np.float32).astype(float) for one in (readings, points)]
    drawn_rounded = {key: values.astype(np.float32).astype(float) for key, values in drawn.items()}
    double = commands(source, DOUBLE)
    exact, expected = double(readings, points, drawn), double(*rounded, drawn_rounded)
    result["double"] = {"state_bytes": source.state_bytes[DOUBLE], **_spread(exact - voltage, largest, 1e-9)}
    for arithmetic, kind in (("single_interface", DOUBLE), ("single", SINGLE)):
        found = commands(source, SINGLE, kind)(*rounded, drawn_rounded)
        result[arithmetic] = {
            "state_bytes": source.state_bytes[kind],
            **_spread(found - expected, largest, ENOUGH),
        }
    result["rounded_readings"] = _spread(expected - exact, largest, ENOUGH)
    return result


def record(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What single-precision arithmetic gave, by pair of controller and estimator: over all loops of it."""
    found = []
    for name, estimator in dict.fromkeys((row["controller"], row["estimator"]) for row in rows):
        own = [row for row in rows if (row["controller"], row["estimator"]) == (name, estimator)]
        loops = sum(row["loops"] for row in own)
        within = sum(row["loops"] * row["single"]["loops_within"] for row in own) / loops
        largest = max(row["single"]["largest"] for row in own)
        found.append(
            {
                "controller": name,
                "estimator": estimator,
                "loops": loops,
                "period": PERIOD,
                "within": within,
                "largest": float(f"{largest:.2g}"),
            }
        )
    return {"rows": found}


def _spread(off: np.ndarray, largest: float, enough: float) -> dict[str, float]:
    """Largest difference of each loop as a share of the largest command, over all loops.

    A loop that jumps is one whose difference grows tenfold within one call, beyond `enough`: a limit, a branch or a layer decided the
    other way. `largest_without_jump`: of the other loops.
    """
    share = np.abs(off) / largest
    before = np.maximum.accumulate(share, axis=1)
    jumped = np.any((share[:, 1:] > enough) & (share[:, 1:] > 10.0 * before[:, :-1]), axis=1)
    most = before[:, -1]
    return {
        "median": float(np.median(most)),
        "quantile_99": float(np.quantile(most, 0.99)),
        "largest": float(np.max(most)),
        "loops_within": float(np.mean(most < enough)),
        "loops_that_jump": float(np.mean(jumped)),
        "largest_without_jump": float(np.max(most[~jumped], initial=0.0)),
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--loops", type=int, default=10_000)
    parser.add_argument("--resume", action="store_true", help="cases that results.json has are not run again")
    given = parser.parse_args()
    cases = [(*case, "arm", GAINS) for case in CASES]
    cases += [(name, "", load, BOX) for name, estimator in CASES if not estimator for load in ("arm", "bias spring")]
    rows = {_case(row): row for row in json.loads(RESULTS.read_text("utf-8"))["closed_loops"]} if given.resume else {}
    for name, estimator, load, gains in cases:
        if (name, estimator, load, gains) in rows:
            continue
        row = closed_loops(name, estimator, given.loops, load, gains)
        rows[_case(row)] = row
        print(json.dumps(row), flush=True)
        done = [rows[case] for case in cases if case in rows]
        replace(RESULTS, json_text({"closed_loops": done}))
        replace(RECORD, json_text(record(done)))


def _case(row: dict[str, Any]) -> tuple[str, str, str, str]:
    return row["controller"], row["estimator"], row["load"], row["gains"]


if __name__ == "__main__":
    main()
