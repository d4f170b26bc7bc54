"""Write cases as experiment folders for `smajax close-loop`, with the truth beside them for the judge alone.

    python -m studies.attribution_benchmark.write OUT [--only TEXT] [--jobs 2]

OUT/<case>/experiment.toml and one CSV per run; OUT/truth/<case>.json, which the loop never sees.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Collection
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studies.attribution_benchmark.cases import Case, Truth, cases, truth
from studies.attribution_benchmark.effects import EFFECTS
from studies.attribution_benchmark.parameters import Wire
from studies.attribution_benchmark.rigs import Rig, show
from studies.attribution_benchmark.runs import Run
from studies.attribution_benchmark.sheet import on_the_sheet

Vector = NDArray[np.float64]
LARGEST_OFFSET = 3.0  # noises: zero of a run
PRESETS = {  # wire, load, drive of the experiment file
    "arm": ("niti_table_3_1", "arm", "amplified_voltage"),
    "dead_weight": ("flexinol_table_3_2", "dead_weight", "voltage"),
    "bias_spring": ("flexinol_ht_500um", "bias_spring", "duty"),
    "coupon": ("flexinol_isobaric", "coupon", "none"),
}
KNOWN = {  # of the bench: exact
    "arm": ('damping = "3e-3 N m s/rad"',),
    "dead_weight": ('wire_diameter = "0.31 mm"', 'damping = "100 N s/m"'),
    "bias_spring": ('damping = "20 N s/m"',),
}
OUTPUT = {  # channel, column, unit, SI value of the unit
    "arm": ("angle", "angle_deg", "deg", np.pi / 180),
    "dead_weight": ("position", "position_mm", "mm", 1e-3),
    "bias_spring": ("position", "position_mm", "mm", 1e-3),
    "coupon": ("strain", "strain_percent", "%", 1e-2),
}
COMMAND = {
    "arm": ("voltage", "voltage_V", "V"),
    "dead_weight": ("voltage", "voltage_V", "V"),
    "bias_spring": ("duty", "duty", "1"),
    "coupon": ("temperature", "temperature_degC", "degC"),
}
OTHER = {"dead_weight": ("mass", "mass_g", "g", 1e-3), "coupon": ("stress", "stress_MPa", "MPa", 1e6)}
BOUNDS: dict[str, tuple[str, Callable[[float], tuple[float, float]]]] = {
    "convection_coefficient": ("W/m^2/K", lambda x: (0.4 * x, 2.5 * x)),
    "specific_heat": ("J/kg/K", lambda x: (0.4 * x, 2.5 * x)),
    "recoverable_strain": ("1", lambda x: (0.5 * x, 1.8 * x)),
    "stress_slope_austenite": ("Pa/K", lambda x: (0.6 * x, 1.6 * x)),
    "stress_slope_martensite": ("Pa/K", lambda x: (0.6 * x, 1.6 * x)),
}
AROUND = 20.0  # K: bounds of the transformation temperatures about their nominal values


def measure(case: Case, true: Truth) -> dict[str, Vector]:
    """Readings of all runs of a case."""
    return readings(true.rig, true.wire, true.effects, case.seed)


def readings(rig: Rig, wire: Wire, effects: dict[str, float], seed: int) -> dict[str, Vector]:
    """Of all runs: what the rig shows, a zero of each run's own, white noise."""
    random = np.random.default_rng([seed, 1])
    read = {}
    for run in rig.runs(wire):
        shown = show(rig, wire, run, effects)
        zero = random.uniform(-LARGEST_OFFSET, LARGEST_OFFSET) * rig.noise
        read[run.name] = shown + zero + random.normal(0.0, rig.noise, shown.size)
    return read


def table_text(rig: Rig, run: Run, read: Vector) -> str:
    columns, names = [[f"{t:.3f}" for t in rig.clock.times]], ["time_s"]
    names.append(COMMAND[rig.name][1])
    columns.append([f"{value:.6g}" for value in run.command])
    if run.other is not None:
        _, name, _, size = OTHER[rig.name]
        names.append(name)
        columns.append([f"{value / size:.6g}" for value in run.other])
    _, name, _, size = OUTPUT[rig.name]
    start = rig.load(rig.mass).start if rig.load is not None else 0.0  # an angle is read from the arm's own zero
    names.append(name)
    columns.append([f"{(value + start) / size:.8g}" for value in read])
    rows = [",".join(names), *[",".join(row) for row in zip(*columns, strict=True)]]
    return "\n".join(rows) + "\n"


def experiment_text(rig: Rig, runs: tuple[Run, ...], known: Collection[str] = ()) -> str:
    """The experiment file of these runs. known: of the wire's sheet, what it says exactly, and no prior is given for."""
    wire, load, drive = PRESETS[rig.name]
    lines = ['title = "Simulated measurement"', "", "[model]"]
    lines += [f'wire = "{wire}"', f'load = "{load}"', f'drive = "{drive}"', "", "[model.parameters]"]
    lines += [
        f'ambient_temperature = "{rig.wire.ambient_temperature:g} degC"',
        *KNOWN.get(rig.name, ()),
        "",
        "[unknown]",
    ]
    for name in rig.unknowns:
        nominal = getattr(rig.wire, name)
        unit, bounds = BOUNDS.get(name, ("degC", lambda x: (x - AROUND, x + AROUND)))
        low, high = bounds(nominal)
        lines.append(
            f'{name} = {{ low = "{low:.6g} {unit}", high = "{high:.6g} {unit}", start = "{nominal:.6g} {unit}" }}'
        )
    lines += ["", "[priors.presets]"]
    lines += [f"{name} = {{ relative = {width:g} }}" for name, width in on_the_sheet(rig).items() if name not in known]
    lines += ["", "[nuisance]", "offset = true", "", "[sampling]", f'step = "{1e3 * rig.clock.step:g} ms"']
    channel, column, unit = COMMAND[rig.name]
    lines += ["", f"[channels.{channel}]", 'role = "input"', f'column = "{column}"', f'unit = "{unit}"']
    if rig.name in OTHER:
        channel, column, unit, _ = OTHER[rig.name]
        lines += ["", f"[channels.{channel}]", 'role = "input"', f'column = "{column}"', f'unit = "{unit}"']
    channel, column, unit, size = OUTPUT[rig.name]
    lines += ["", f"[channels.{channel}]", 'role = "output"', f'column = "{column}"', f'unit = "{unit}"']
    lines += [f'noise = "{rig.noise / size:.6g} {unit}"', "", "[time]", 'column = "time_s"', 'unit = "s"']
    for run in runs:
        lines += ["", "[[runs]]", f'name = "{run.name}"', f'role = "{run.role}"', f'file = "{run.name}.csv"']
    return "\n".join(lines) + "\n"


def _known(strength: float) -> float | None:
    return None if np.isnan(strength) else strength


def write(case: Case, out: Path) -> Truth:
    """Write one case; a folder that is there is whole, for it gets its name last."""
    true = truth(case)
    read = measure(case, true)
    folder, half = out / case.name, out / f".{case.name}.{os.getpid()}"
    half.mkdir(parents=True)
    runs = true.rig.runs(true.wire)
    for run in runs:
        (half / f"{run.name}.csv").write_text(table_text(true.rig, run, read[run.name]))
    (half / "experiment.toml").write_text(experiment_text(true.rig, runs))
    record = {
        "case": case.name,
        "kind": case.kind,
        "rig": case.rig,
        "effects": {
            name: {
                **asdict(f),
                "strength": _known(f.strength),
                "unit": EFFECTS[name].unit,
                "outside": EFFECTS[name].outside,
                "group": EFFECTS[name].group,
            }
            for name, f in true.found.items()
        },
        "strength_asked": case.strength if case.sized else None,
        "strength_together": _known(true.together),
        "parameters": {name: getattr(true.wire, name) for name in (*true.rig.unknowns, *on_the_sheet(true.rig))},
        "noise": true.rig.noise,
        "seed": case.seed,
    }
    judge = out / "truth"
    judge.mkdir(parents=True, exist_ok=True)
    waiting = judge / f".{case.name}.{os.getpid()}"
    waiting.write_text(json.dumps(record, indent=1) + "\n")
    waiting.rename(judge / f"{case.name}.json")
    half.rename(folder)
    return true


def main() -> None:
    """Write the cases that are not there yet."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", default="", help="cases whose name contains this text")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--list", action="store_true", help="print the names and stop")
    given = parser.parse_args()
    wanted = [case for case in cases() if given.only in case.name]
    if given.list:
        print("\n".join(case.name for case in wanted))
        return
    wanted = [case for case in wanted if not (given.out / case.name).exists()]
    with ProcessPoolExecutor(given.jobs) as pool:
        waiting = {pool.submit(write, case, given.out): case for case in wanted}
        for i, done in enumerate(as_completed(waiting), 1):
            case, true = waiting[done], done.result()
            found = ", ".join(f"{n} {f.coefficient:.3g} ({f.strength:.2f} noises)" for n, f in true.found.items())
            capped = " CAPPED" if any(f.capped for f in true.found.values()) else ""
            print(f"{i}/{len(wanted)} {case.name}: {found or 'nothing hidden'}{capped}", flush=True)


if __name__ == "__main__":
    main()
