"""What a step costs in C beside the package's own: `python -m studies.exported_code.timing`, into timing.json beside it.

Processor time, so that other programs on the machine do not count; medians of `TIMES` runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.core.runtime import prepare

prepare()

from smajax.control.loop_around import loop_around  # noqa: E402
from smajax.core.files import json_text, replace  # noqa: E402
from smajax.core.operating_system import processor_name  # noqa: E402
from smajax.export.from_files import plant_source  # noqa: E402
from smajax.export.single_precision import DOUBLE, SINGLE  # noqa: E402
from smajax.model.rigs import arm, dead_weight  # noqa: E402
from smajax.simulation.compiled import simulate_compiled  # noqa: E402
from studies.exported_code.built import commands, open_loop  # noqa: E402
from studies.exported_code.run import source_of  # noqa: E402
from studies.source.unloading import EVEN_VOLTS as VOLTS  # noqa: E402

TIMES, CLOCK, SAMPLES, TOLERANCE = 7, 0.005, 2001, 1e-5
CONTROLLERS = [("pid", ""), ("sld", "printed"), ("pid", "model")]


def spent(run: Callable[[], Any]) -> float:
    """Median processor time of a call, s, after one that compiles."""
    run()
    found = []
    for _ in range(TIMES):
        begin = time.process_time()
        run()
        found.append(time.process_time() - begin)
    return median(found)


def models() -> list[dict[str, Any]]:
    rows = []
    for name, system, volts in (("arm of M3", arm(), 7.3), ("dead weight of M13", dead_weight(), VOLTS)):
        inputs = {"voltage": np.full(SAMPLES, volts)}
        given = {"voltage": jnp.asarray(inputs["voltage"])}
        package = spent(partial(simulate_compiled, system, given, CLOCK, tolerance=TOLERANCE))
        source = plant_source(system, tolerance=TOLERANCE)
        _, own = open_loop(source, inputs, CLOCK, TIMES)
        rows.append(
            {
                "model": name,
                "package_seconds_a_step": package / (SAMPLES - 1),
                "c_seconds_a_step": median(own) / (SAMPLES - 1),
                "state_bytes": source.state_bytes[DOUBLE],
                "source_bytes": len(source.source),
            }
        )
        print(rows[-1], flush=True)
    return rows


def controllers() -> list[dict[str, Any]]:
    rows, readings = [], np.linspace(-0.7, 0.3, 2000)[None]
    for name, estimator in CONTROLLERS:
        source = source_of(loop_around(arm(), name, estimator=estimator or None), name)
        row: dict[str, Any] = {"controller": name, "estimator": estimator}
        for kind in (DOUBLE, SINGLE):
            run = commands(source, kind)
            row[f"{kind}_seconds_a_call"] = spent(partial(run, readings, np.full_like(readings, 0.2))) / readings.size
        rows.append(row)
        print(row, flush=True)
    return rows


def main() -> None:
    result = {"processor": processor_name(), "models": models(), "controllers": controllers()}
    replace(Path(__file__).with_name("timing.json"), json_text(result))


if __name__ == "__main__":
    main()
