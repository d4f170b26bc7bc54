"""Experiment files of a hung weight whose runs are integrated by scipy, which shares no code with the package."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from studies.reference.wire_parameters import DeadWeightParameters
from studies.reference.wire_reference import simulate_dead_weight

STEP, SECONDS = 0.02, 8.0
GIVEN = DeadWeightParameters()
TRUTH = {
    "convection_coefficient": GIVEN.convection_coefficient,
    "specific_heat": GIVEN.specific_heat,
    "recoverable_strain": GIVEN.recoverable_strain,
}
NOISE = {"position": 2e-4, "temperature": 0.5, "resistance": 0.05}
UNITS = {"position": "m", "temperature": "degC", "resistance": "ohm"}
HEAD = f"""
title = "Hung weight"
[model]
wire = "flexinol_table_3_2"
load = "dead_weight"
drive = "voltage"
[model.parameters]
damping = "{GIVEN.damping} N s/m"
[sampling]
step = "{STEP} s"
[time]
column = "t"
[channels.voltage]
role = "input"
column = "U"
unit = "V"
"""
UNKNOWN = """
[unknown]
convection_coefficient = { low = "50 W/m^2/K", high = "400 W/m^2/K", start = "190 W/m^2/K" }
specific_heat = { low = "100 J/(kg K)", high = "900 J/(kg K)", start = "230 J/(kg K)" }
recoverable_strain = { low = "1 %", high = "10 %", start = "6 %" }
"""


@dataclass(frozen=True)
class HungRun:
    """One run: volts from a time on, the mass, and what it starts with (None: at the air's temperature)."""

    name: str
    volts: tuple[tuple[float, float], ...]  # (until, V)
    mass: float = 0.1
    role: str = "fit"
    celsius: float | None = None
    fraction: float = 1.0


SWITCHED = HungRun("switched", ((4.0, 7.4), (SECONDS, 0.0)))
PULSED = HungRun("pulsed", ((2.0, 7.6), (3.5, 3.0), (5.5, 7.0), (SECONDS, 2.0)), 0.2)
STAIRS = HungRun("stairs", ((2.0, 5.0), (4.5, 7.0), (SECONDS, 4.0)), 0.15, "held-out")


@cache
def exact(run: HungRun) -> dict[str, np.ndarray]:
    """What ideal sensors show."""
    time = STEP * np.arange(round(SECONDS / STEP) + 1)
    wire = dataclasses.replace(GIVEN, initial_temperature=run.celsius, initial_martensite_fraction=run.fraction)
    segments = [(until, volts, run.mass) for until, volts in run.volts]
    found = simulate_dead_weight(wire, segments, time)
    fraction = found["martensite_fraction"]
    ohms = wire.resistance_austenite + fraction * (wire.resistance_martensite - wire.resistance_austenite)
    volts = np.asarray([volts for _, volts in run.volts])
    ends = [until - 1e-9 for until, _ in run.volts[:-1]]
    found["U"] = volts[np.searchsorted(ends, time, side="right")]
    return {**found, "resistance": ohms * wire.length}


def write(
    folder: Path,
    runs: tuple[HungRun, ...],
    noise: Mapping[str, str],
    more: str = UNKNOWN,
    *,
    seed: int = 3,
    noise_scale: float = 1.0,
    missing: Mapping[str, float] | None = None,
) -> Path:
    """`experiment.toml` and its runs; `noise`: by output, what the file says; `missing`: by output, share of empty cells."""
    rng = np.random.default_rng(seed)
    text = HEAD + more
    for name, said in noise.items():
        skip = 'missing = "skip"\n' if missing and name in missing else ""
        text += f'[channels.{name}]\nrole = "output"\ncolumn = "{name}"\nunit = "{UNITS[name]}"\n{skip}'
        text += f'noise = "{said}"\n'
    for run in runs:
        ideal = exact(run)
        cells = {"t": [f"{value:.6f}" for value in ideal["time"]], "U": [f"{value:.9g}" for value in ideal["U"]]}
        for name in noise:
            values = ideal[name] + noise_scale * NOISE[name] * rng.standard_normal(len(ideal["time"]))
            lost = rng.random(len(values)) < (missing or {}).get(name, 0.0)
            cells[name] = ["" if gone else f"{value:.9g}" for value, gone in zip(values, lost, strict=True)]
        rows = "\n".join(",".join(row) for row in zip(*cells.values(), strict=True))
        (folder / f"{run.name}.csv").write_text(",".join(cells) + "\n" + rows + "\n")
        text += f'[[runs]]\nname = "{run.name}"\nrole = "{run.role}"\nfile = "{run.name}.csv"\n'
        text += f'inputs = {{ mass = "{1e3 * run.mass:g} g" }}\n'
    (folder / "experiment.toml").write_text(text)
    return folder / "experiment.toml"
