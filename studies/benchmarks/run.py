"""Every benchmark in one run: `python -m studies.benchmarks.run [PART ...] [--fast] [--out FOLDER]`.

Parts are written one by one to FOLDER (default `studies/benchmarks/results/<processor>`), and the table of ratios is made
of those that are there. Give parts by name to measure them again. diffrax is timed by the interpreter that
`SMAJAX_DIFFRAX_PYTHON` names, gradsolve and numba by those of `SMAJAX_GRADSOLVE_PYTHON` and `SMAJAX_NUMBA_PYTHON`. Nothing
else should run beside it; ratios are of one run on one machine.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from smajax.core.machine import machine
from smajax.core.runtime import prepare
from smajax.simulation.simulate import DEFAULT_STEP
from studies.benchmarks import cpp, peers
from studies.benchmarks.table import told

RESULTS = Path(__file__).parent / "results"
SOLVED = 64
Part = dict[str, Any]


# Sizes of the load tests: `studies.benchmarks.load`.
LOADS = {
    "text": (1000, 5000),
    "samples": (10**5, 10**6, 10**7),
    "day": (6, 24),
    "runs": (100, 500),
}
FEW_LOADS = {"text": (20,), "samples": (10**4,), "day": (1,), "runs": (10,)}


class Plan:
    """How much is measured."""

    def __init__(self, fast: bool) -> None:
        self.fast = fast
        self.members = 4096 if fast else 65536
        self.scipy_members = 16 if fast else 64
        self.diffrax_members = 2048 if fast else 8192
        self.tracked = 64 if fast else 256
        self.steps = (1000, 4000) if fast else (1000, 10_000, 100_000, 1_000_000)
        self.counts = (10**3, 10**4) if fast else (10**4, 10**5, 10**6)
        self.loads = FEW_LOADS if fast else LOADS

    def file(self) -> Path:
        """The problem, solved once and stored beside the results."""
        from studies.benchmarks.problem import given

        return given(8 if self.fast else SOLVED, self.members, RESULTS / "problems")[0]

    def tracking(self) -> Path:
        """The gradient's problem, likewise."""
        from studies.benchmarks.problem import constants
        from studies.benchmarks.tracking import tracking

        return tracking(constants(), 4 if self.fast else 8, self.tracked, RESULTS / "problems")[0]

    def own(self, name: str, *options: object) -> Part:
        """One of our own parts in a fresh process."""
        return peers.run_peer(name, sys.executable, *map(str, options))


def _cpp(plan: Plan) -> Part:
    import os

    from smajax.model.rigs import arm
    from studies.benchmarks.given import load

    given = load(plan.file())
    rows = np.stack([given.voltage, given.payload_mass], axis=1)
    steps, every = round(given.seconds / DEFAULT_STEP), round(float(given.times[1]) / DEFAULT_STEP)
    result: Part = {"peer": "cpp"}
    with TemporaryDirectory() as place:
        program = cpp.build(Path(place))
        if program is None:
            return {**result, "reason": cpp.MISSING}
        for precision in cpp.PRECISIONS:
            one = cpp.run(program, arm(), rows, DEFAULT_STEP, steps, os.cpu_count() or 1, precision, 3)
            solved = cpp.run(
                program,
                arm(),
                rows[: given.solved],
                DEFAULT_STEP,
                steps,
                1,
                precision,
                every=every,
                recorded=given.solved,
            )
            off = given.errors(np.degrees(solved.angle).T, solved.fraction.T)
            result[precision] = {
                "angle_error": off[0],
                "fraction_error": off[1],
                "accurate": given.meets(off),
                "ms_per_trajectory": 1e3 * one.seconds / plan.members,
                "iterations_per_stage": one.iterations_per_stage,
            }
    return result


# The voltage is held, so that nothing asks for a step to end before a quarter of a second: compared with the exact solution there.
OWN_STEPS = ("--dt", "0.25", "--tolerance", "1e-3")

PARTS: dict[str, Callable[[Plan], Part]] = {
    "smajax": lambda plan: plan.own("throughput", plan.file(), "--count", plan.members),
    "cpp": _cpp,
    "smajax_float32": lambda plan: plan.own("throughput", plan.file(), "--count", plan.members, "--single-precision"),
    "smajax_own_steps": lambda plan: plan.own("throughput", plan.file(), "--count", plan.members, *OWN_STEPS),
    "smajax_own_steps_float32": lambda plan: plan.own(
        "throughput", plan.file(), "--count", plan.members, *OWN_STEPS, "--single-precision"
    ),
    "scipy": lambda plan: peers.scipy(plan.file(), plan.scipy_members),
    "diffrax": lambda plan: peers.diffrax(plan.file(), count=plan.diffrax_members),
    "numba": lambda plan: peers.numba(plan.file(), DEFAULT_STEP, count=plan.members),
    "single": lambda plan: plan.own("single", plan.file()),
    "gradient": lambda plan: plan.own("gradient", "--steps", 2000, "--members", 64 if plan.fast else 512, "--forward"),
    "gradient_tracking": lambda plan: plan.own("gradient", "--tracking", plan.tracking(), "--forward"),
    "gradient_diffrax": lambda plan: peers.gradient("diffrax", plan.tracking()),
    "gradient_gradsolve": lambda plan: peers.gradient("gradsolve", plan.tracking()),
    "gradient_memory": lambda plan: {
        "peer": "gradient_memory",
        "runs": [plan.own("gradient", "--steps", steps, "--members", 1) for steps in plan.steps],
    },
    "scale": lambda plan: {
        "peer": "scale",
        "runs": [plan.own("scale", "--count", count) for count in plan.counts],
    },
    "loads": lambda plan: {
        "peer": "loads",
        "runs": [plan.own("load", what, "--count", count) for what, counts in plan.loads.items() for count in counts],
    },
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; default: what is not there yet"
    )
    parser.add_argument("--fast", action="store_true", help="small: to see that it runs")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    unknown = sorted(set(options.parts) - set(PARTS))
    if unknown:
        parser.error(f"no part {unknown}; there are {', '.join(PARTS)}")
    prepare()
    here = machine()
    slug = re.sub(r"[^a-z0-9]+", "-", str(here["processor"]).lower()).strip("-")
    out = options.out or RESULTS / (f"{slug}-{here['cores']}-cores" + ("-fast" if options.fast else ""))
    out.mkdir(parents=True, exist_ok=True)
    plan = Plan(options.fast)
    for name, part in PARTS.items():
        file = out / f"{name}.json"
        if file.exists() and name not in options.parts:
            continue
        if options.parts and name not in options.parts:
            continue
        print(f"measuring {name} ...", flush=True)
        whole = out / f".{name}.json"
        whole.write_text(json.dumps({"machine": machine(), **part(plan)}, indent=1) + "\n", encoding="utf-8")
        whole.replace(file)
    result = {name: json.loads((out / f"{name}.json").read_text()) for name in PARTS if (out / f"{name}.json").exists()}
    text = told(here, result)
    (out / "README.md").write_text(text, encoding="utf-8")
    print(text)
    print(f"written to {out}")


if __name__ == "__main__":
    main()
