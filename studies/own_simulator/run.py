"""The loop on benches of which some equations differ from the base model's, by a simulator that shares no code with the package.

    python -m studies.own_simulator.run --out OUT                     # every bench
    python -m studies.own_simulator.run --out OUT --only all-three     # or one

Of each bench it writes the logs and the experiment, closes the loop, and says what was named, with which sizes, and the errors on the held-out runs.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from studies.own_simulator.simulator import Bench, simulated

SAMPLE, COUNT = 0.05, 2000  # s, samples of a run
NOISE, SEED = 1e-5, 69  # m
ALIKE = 50e9, 50e9  # Pa: without a mismatch
BENCHES = {
    "all-three": Bench(),
    "no-rising-air": Bench(exponent=0.0),
    "no-mismatch": Bench(moduli=ALIKE),
    "no-friction": Bench(friction=0.0),
    "nothing": Bench(exponent=0.0, moduli=ALIKE, friction=0.0),
}


def true_coefficients(name: str) -> dict[str, float]:
    """Of the effects that a bench has and the model of its experiment file lacks."""
    bench = BENCHES[name]
    austenite, martensite = bench.moduli
    every = {
        "free_convection.exponent": bench.exponent,
        "elastic_mismatch.contrast": austenite / martensite - 1.0,
        "coulomb_friction.limit": bench.friction,
    }
    return {coefficient: value for coefficient, value in every.items() if value}


def _levels(*pairs: tuple[float, float]) -> np.ndarray:
    """Currents (A), each for so long (s), the last one to the end."""
    parts = [np.full(round(seconds / SAMPLE), current) for current, seconds in pairs]
    whole = np.concatenate([*parts, np.full(COUNT, pairs[-1][0])])
    return whole[:COUNT]


def _lines(*corners: tuple[float, float]) -> np.ndarray:
    """Straight lines through (s, A)."""
    seconds, currents = zip(*corners, strict=True)
    return np.interp(np.arange(COUNT) * SAMPLE, seconds, currents)


def commands() -> dict[str, np.ndarray]:
    """Current of each run, A, as a converter of three decimals gives it."""
    runs = {
        "steps": _levels(
            *((0, 1), (1.6, 14), (1.75, 6), (0.9, 7), (0.6, 6), (1.8, 9), (0.7, 6.5)),
            *((1.9, 7), (0.5, 4.5), (2.0, 6), (1.3, 5), (0.3, 5), (1.9, 8), (0, 15)),
        ),
        "triangles": _lines(
            *((0, 0.8), (16, 2.0), (28, 0.2), (40, 2.1), (49, 0.4), (57, 1.9)),
            *((66, 0.3), (76, 2.05), (86, 0.5), (94, 1.95), (100, 0.6)),
        ),
        "pulses": _levels(
            *((0, 2), (3.0, 2.6), (0, 6.0), (2.5, 3.0), (0.3, 4.0), (2.2, 2.4), (0.5, 7.4), (2.8, 3.0)),
            *((0, 4.6), (3.0, 1.3), (0.4, 5.2), (2.0, 3.4), (0, 5.8), (2.6, 2.4), (0.6, 5.0), (2.4, 2.2)),
            *((0, 4.4), (2.0, 2.5), (0.2, 5.5), (2.7, 2.4), (0.9, 6.4), (2.5, 1.0), (0, 20)),
        ),
        "ramps": _lines((0, 1.2), (34, 1.72), (62, 0.75), (84, 1.75), (100, 0.7)),
        "partial strokes": _levels(
            *((0.3, 1), (2.3, 4.3), (0.8, 5), (2.1, 2.6), (0.4, 4.3), (2.0, 3.3), (0.7, 6.2), (1.8, 4.4)),
            *((0.2, 3.8), (2.4, 2.1), (0.6, 5.6), (2.0, 3.6), (0.5, 4.9), (2.2, 2.4), (0.9, 7.0), (1.7, 5.2)),
            *((0.3, 4.2), (2.1, 2.7), (0.6, 5.5), (1.9, 3.7), (0.8, 6.5), (2.2, 2.0), (0.5, 10)),
        ),
    }
    return {name: np.round(current, 3) for name, current in runs.items()}


def write(out: Path, bench: str) -> Path:
    """The experiment's folder: what the bench would have logged, and the experiment file."""
    random = np.random.default_rng(SEED)
    logs = out / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    seconds = np.arange(COUNT) * SAMPLE
    for name, current in commands().items():
        position = simulated(BENCHES[bench], current, SAMPLE) + NOISE * random.standard_normal(COUNT)
        np.savetxt(
            logs / f"{name}.csv",
            np.column_stack([seconds, current, position]),
            fmt=("%.2f", "%.3f", "%.7f"),
            delimiter=",",
            header="time [s],current [A],position [m]",
            comments="",
        )
    text = Path(__file__).with_name("experiment.toml").read_text(encoding="utf-8")
    (out / "experiment.toml").write_text(text, encoding="utf-8")
    return out / "experiment.toml"


def told(record: Mapping[str, Any], bench: str) -> dict[str, Any]:
    """What `report.json` says was named, with sizes beside the true ones, and the errors, m."""
    added = [effect for effect in record["effects"] if effect["added"]]
    return {
        "verdict": record["verdict"],
        "added": [effect["name"] for effect in added],
        "sizes": {
            f"{effect['name']}.{name}": one["value"] for effect in added for name, one in effect["coefficients"].items()
        },
        "true": true_coefficients(bench),
        "rmse": {run["name"]: (run["rmse_before"], run["rmse_after"]) for run in record["runs"]},
        "band_coverage": {run["name"]: run["band_coverage"] for run in record["runs"]},
    }


def closed(out: Path, bench: str) -> dict[str, Any]:
    """The loop on a bench, in a folder."""
    command = [sys.executable, "-m", "smajax", "close-loop", str(write(out, bench)), "--out", str(out / "report")]
    subprocess.run(command, check=True)
    return told(json.loads((out / "report" / "report.json").read_text(encoding="utf-8")), bench)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", choices=BENCHES, help="one of the benches")
    options = parser.parse_args()
    for name in [options.only] if options.only else BENCHES:
        result = closed(options.out / name, name)
        (options.out / name / "results.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(name, json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
