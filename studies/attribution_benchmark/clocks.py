"""Nulls of the benchmark logged at other clocks: nothing is missing, and the integration must not make it look so.

    python -m studies.attribution_benchmark.clocks --out OUT [--rig dead_weight] [--clock 20]

The arm and the dead weight as in `rigs`, the same excitations for as long, with 5, 20, 50 and 100 ms between two samples. A line a case:
the verdict, what the integration leaves in noises, and the time.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

from studies.attribution_benchmark.cases import Case, true_wire
from studies.attribution_benchmark.rigs import ARM, DEAD_WEIGHT, Rig
from studies.attribution_benchmark.runs import Clock, powered
from studies.attribution_benchmark.write import experiment_text, readings, table_text

CLOCKS = (5, 20, 50, 100)  # ms
STRESSES: dict[str, tuple[float, float, tuple[float, ...]]] = {
    "arm": (105e6, 105e6, ()),
    "dead_weight": (83e6, 139e6, (0.64, 1.07)),
}


def at_clock(rig: Rig, step: float) -> Rig:
    """The rig with `step` s between samples of its log; commands change as often as before."""
    clock = rig.clock
    own = Clock(step, max(1, round(clock.update * clock.step / step)), round(clock.seconds / step) + 1)
    light, heavy, masses = STRESSES[rig.name]
    return replace(rig, clock=own, runs=lambda wire: powered(own, wire, light, heavy, masses))


def written(rig: Rig, number: int, folder: Path) -> None:
    """One null as an experiment."""
    case = Case(rig.name, (), 0.0, number)
    wire = true_wire(case)
    read = readings(rig, wire, {}, case.seed)
    folder.mkdir(parents=True)
    runs = rig.runs(wire)
    for run in runs:
        (folder / f"{run.name}.csv").write_text(table_text(rig, run, read[run.name]))
    (folder / "experiment.toml").write_text(experiment_text(rig, runs))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--rig", choices=STRESSES)
    parser.add_argument("--clock", type=int, choices=CLOCKS, help="ms")
    parser.add_argument("--number", type=int, default=0, help="of the null: other wires")
    asked = parser.parse_args()
    from smajax.attribution.close_loop import close_loop
    from smajax.core.runtime import prepare
    from smajax.data.experiment.load import load_experiment
    from smajax.data.model_catalogue import CATALOGUE

    prepare()
    for rig in (ARM, DEAD_WEIGHT):
        for clock in CLOCKS:
            if asked.rig not in (None, rig.name) or asked.clock not in (None, clock):
                continue
            folder = asked.out / f"{rig.name}-{clock}ms-{asked.number}"
            if not folder.exists():
                written(at_clock(rig, clock / 1e3), asked.number, folder)
            began = time.monotonic()
            found = close_loop(load_experiment(folder / "experiment.toml", CATALOGUE), memory=None)
            error = found.integration
            record = {
                "rig": rig.name,
                "clock_ms": clock,
                "verdict": found.verdict.value,
                "integration_error": error.record(),
                "seconds": time.monotonic() - began,
            }
            print(json.dumps(record), flush=True)


if __name__ == "__main__":
    main()
