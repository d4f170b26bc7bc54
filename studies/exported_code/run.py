"""Exported controllers against the package over many closed loops: `python -m studies.exported_code.run [--loops N]`, into results.json."""

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
from smajax.export.source import CSource, c_source  # noqa: E402
from smajax.model.rigs import arm  # noqa: E402
from studies.exported_code.built import commands  # noqa: E402

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
    result["largest_command"] = largest
    drive = {kind: commands(source, kind) for kind in (DOUBLE, SINGLE)}
    rounded = [one.astype(np.float32).astype(float) for one in (readings, points)]
    exact, expected, found = drive[DOUBLE](readings, points), drive[DOUBLE](*rounded), drive[SINGLE](*rounded)
    result[DOUBLE] = {"state_bytes": source.state_bytes[DOUBLE], **_spread(exact - voltage, largest, 1e-9)}
    result[SINGLE] = {"state_bytes": source.state_bytes[SINGLE], **_spread(found - expected, largest, 1e-5)}
    result["rounded_readings"] = _spread(expected - exact, largest, 1e-5)
    return result


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
    given = parser.parse_args()
    result: dict[str, Any] = {"closed_loops": []}
    for name, estimator in CASES:
        result["closed_loops"].append(closed_loops(name, estimator, given.loops))
        print(json.dumps(result["closed_loops"][-1]), flush=True)
        replace(RESULTS, json_text(result))


if __name__ == "__main__":
    main()
