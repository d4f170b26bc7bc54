"""Exported units run by FMPy, a client that is not ours: `python -m studies.exported_code.in_fmpy [PART ...]`, into fmpy.json beside it.

Needs a C compiler and FMPy (`pip install fmpy`). Prints the tables of the README.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from smajax.core.runtime import prepare

prepare()

from smajax.control.closed_loop import simulate_closed_loop  # noqa: E402
from smajax.control.loop_around import loop_around  # noqa: E402
from smajax.control.reference import clock, steps  # noqa: E402
from smajax.core.files import json_text, replace  # noqa: E402
from smajax.engine import program  # noqa: E402
from smajax.export.fmu import VERSIONS, fmu  # noqa: E402
from smajax.export.from_files import plant_source  # noqa: E402
from smajax.export.source import CSource  # noqa: E402
from smajax.model.rigs import arm, dead_weight  # noqa: E402
from smajax.model.system import System  # noqa: E402
from smajax.simulation.compiled import simulate_compiled  # noqa: E402
from smajax.simulation.steppers import Integration  # noqa: E402
from studies.exported_code.run import PERIOD, source_of  # noqa: E402
from studies.exported_code.slave import Slave  # noqa: E402
from studies.source.unloading import EVEN_VOLTS as VOLTS  # noqa: E402
from studies.source.unloading import INITIAL_MASS  # noqa: E402

RESULTS = Path(__file__).with_name("fmpy.json")
TOLERANCE, CLOCK, MANY, ROUNDS = 1e-5, 0.005, 10_000, 3


def written(source: CSource, version: str, folder: Path) -> Path:
    path = Path(tempfile.mkdtemp(dir=folder)) / f"{source.name}.fmu"
    path.write_bytes(fmu(source, version))
    return path


def figures() -> dict[str, tuple[System, float, dict[str, list[tuple[float, float]]]]]:
    """Name -> (system, length in s, inputs as corners (s, value) between which FMPy goes along straight lines)."""
    left = INITIAL_MASS - 0.096
    mass = [
        (0.0, INITIAL_MASS),
        (40.0, INITIAL_MASS),
        (40.0, left),
        (60.0, left),
        (60.0, INITIAL_MASS),
        (80.0, INITIAL_MASS),
    ]
    return {
        "M2": (arm(), 10.0, {"voltage": [(0.0, 7.2), (10.0, 7.2)]}),
        "M3": (arm(), 10.0, {"voltage": [(0.0, 7.3), (10.0, 7.3)]}),
        "M13": (dead_weight(), 80.0, {"voltage": [(time, VOLTS) for time, _ in mass], "mass": mass}),
    }


def series_of(corners: list[tuple[float, float]], length: float) -> np.ndarray:
    """Held from sample to sample of the package's clock; at a jump the value behind it."""
    times, values = np.asarray(corners).T
    at = np.arange(round(length / CLOCK) + 1) * CLOCK
    return values[np.minimum(np.searchsorted(times, at + 1e-9), len(values) - 1)]


def off(ours: Any, theirs: Any) -> float:
    return float(np.max(np.abs(np.asarray(ours) - np.asarray(theirs))))


def open_loops(folder: Path) -> list[dict[str, Any]]:
    """FMPy's own master over each figure, at communication steps of 1, 5 and 50 ms."""
    from fmpy import simulate_fmu

    rows = []
    for name, (system, length, inputs) in figures().items():
        source = plant_source(system, name.lower(), tolerance=TOLERANCE)
        given = {key: jnp.asarray(series_of(corners, length)) for key, corners in inputs.items()}
        run, exact = (
            np.asarray(simulate_compiled(system, given, CLOCK, tolerance=size).reading) for size in (TOLERANCE, 1e-8)
        )
        corners = list(inputs.values())
        signals = np.array(
            [(corners[0][k][0], *(one[k][1] for one in corners)) for k in range(len(corners[0]))],
            dtype=[("time", np.float64), *((key, np.float64) for key in inputs)],
        )
        for version in VERSIONS:
            path = written(source, version, folder)
            row: dict[str, Any] = {
                "figure": name,
                "fmi": version,
                "range": float(np.ptp(exact)),
                "package": off(run, exact),
            }
            for seconds in (0.001, 0.005, 0.05):
                found = simulate_fmu(
                    str(path), stop_time=length, output_interval=seconds, input=signals, output=["reading"],
                    start_values={key: float(values[0]) for key, values in given.items()}, validate=False,
                )  # fmt: skip
                places = np.round(found["time"] / CLOCK).astype(int)
                shared = np.abs(found["time"] - places * CLOCK) < 1e-9
                places, reading = places[shared], found["reading"][shared]
                row[f"{1e3 * seconds:g}_ms"] = off(reading, exact[places])
                row[f"{1e3 * seconds:g}_ms_from_package"] = off(reading, run[places])
            rows.append(row)
            print(row, flush=True)
    return rows


def closed_loops(folder: Path) -> list[dict[str, Any]]:
    """A controller's unit with the plant's, against the package's closed loop with the same tolerance."""
    rows = []
    wanted = steps(clock(4.0, 0.5 * PERIOD), [0.2, -0.4], 2.0)
    for name, estimator in (("pid", ""), ("sld", "printed")):
        loop = loop_around(arm(), name, estimator=estimator or None)

        def one(loop: Any, own: dict[str, Any]) -> Any:
            integration = Integration(jnp.asarray(own["tolerance"]))
            found = simulate_closed_loop(
                loop.system, loop.controller, wanted, 0.5 * PERIOD, 2, estimator=loop.estimator, integration=integration
            )
            return found.run.reading, found.voltage

        (run, exact), (volts, _) = map(
            np.asarray, program(one, loop, ("tolerance",))(loop, {"tolerance": np.asarray([TOLERANCE, 1e-8])})
        )
        for version in VERSIONS:
            plant, controller = (
                Slave(path, path.parent).begin()
                for path in (
                    written(source, version, folder)
                    for source in (plant_source(arm(), tolerance=TOLERANCE), source_of(loop, name))
                )
            )
            readings, commands = plant.get("reading"), []
            for k in range(400):
                controller.set(reading=readings[-1], set_point=float(wanted.position[2 * k]))
                controller.step(k * PERIOD, PERIOD)
                commands += controller.get("command")
                plant.set(voltage=commands[-1])
                plant.step(k * PERIOD, PERIOD)
                readings += plant.get("reading")
            plant.close()
            controller.close()
            rows.append(
                {
                    "controller": name,
                    "estimator": estimator,
                    "fmi": version,
                    "range": float(np.ptp(readings)),
                    "package": off(run, exact),
                    "reading_from_package": off(readings, run[::2]),
                    "command_from_package": off(commands, volts[:-1:2]),
                }
            )
            print(rows[-1], flush=True)
    return rows


def checked(folder: Path) -> list[dict[str, Any]]:
    """What FMPy's checker finds, and a state that is gone back to."""
    from fmpy.validation import validate_fmu

    rows = []
    for version in VERSIONS:
        plant = written(plant_source(arm()), version, folder)
        units = [plant, written(source_of(loop_around(arm(), "pid"), "pid"), version, folder)]
        one = Slave(plant, plant.parent).begin(voltage=7.3)
        one.step(0.0, 1.5)
        saved = one.state()
        ends = []
        for _ in range(2):
            one.step(1.5, 0.5)
            ends.append(one.get("reading", "temperature", "stress"))
            one.back_to(saved)
        one.free(saved)
        one.close()
        problems = [problem for path in units for problem in validate_fmu(str(path))]
        rows.append({"fmi": version, "problems": problems, "rolled_back": off(*ends)})
        print(rows[-1], flush=True)
    return rows


def resident() -> int:
    """Bytes of this process in memory now (Linux)."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def memory(folder: Path) -> list[dict[str, Any]]:
    """`MANY` instances that exist at once, each made, initialised, stepped, saved, restored, stepped again, terminated and freed; all of it `ROUNDS` times.

    Their states are compared, so that instances that shared anything would show.
    """
    rows = []
    for version in VERSIONS:
        path = written(plant_source(arm()), version, folder)
        Slave(path, path.parent).begin(voltage=7.3).close()  # what is loaded once
        row: dict[str, Any] = {
            "fmi": version,
            "instances": MANY,
            "before": resident(),
            "all_alive": [],
            "all_freed": [],
        }
        volts = np.linspace(5.0, 9.0, MANY)
        for _ in range(ROUNDS):
            alive = [Slave(path, path.parent).begin(voltage=float(volt)) for volt in volts]
            for one in alive:
                one.step(0.0, 0.02)
            for one in alive:
                saved = one.state()
                one.step(0.02, 0.02)
                ended = one.get("temperature")
                one.back_to(saved)
                one.step(0.02, 0.02)
                assert one.get("temperature") == ended
                one.free(saved)
            warmth = [one.get("temperature")[0] for one in alive]
            row["all_alive"].append(resident())
            for one in alive:
                one.close()
            del alive, one
            row["all_freed"].append(resident())
        row["warmer_with_more_volts"] = bool(np.all(np.diff(warmth) > 0.0))
        rows.append(row)
        print(row, flush=True)
    return rows


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder, result = Path(name), json.loads(RESULTS.read_text("utf-8")) if RESULTS.exists() else {}
        chosen = sys.argv[1:]
        for what in (checked, closed_loops, open_loops, memory):
            if chosen and what.__name__ not in chosen:
                continue
            result[what.__name__] = what(folder)
            replace(RESULTS, json_text(result))


if __name__ == "__main__":
    main()
