"""The closed loops of a controller's sweep as a table: a CSV file."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from smajax.control.sweep.grid import Grid
from smajax.control.sweep.run_sweep import ControllerSweep
from smajax.core.files import replace
from smajax.report.sweep_numbers import SHOWN, merit_values, shown_in


def write_rows(path: Path, grid: Grid, sweep: ControllerSweep) -> None:
    """Every closed loop in a row; angles in degrees, lengths in millimetres, an empty cell where a time is infinite. Of a batch its plants' values too, SI."""
    *ratios, target, gain = (axis.ravel() for axis in grid.axes())
    ratios = ratios[: len(grid.mismatches)]
    position = grid.plants.unit
    plants = {name: values.ravel() for name, values in grid.plant_values().items()}
    inputs = np.stack([*ratios, *plants.values(), position.of(target), gain], axis=1)
    columns = [
        *grid.axis_names,
        *plants,
        f"set_point_{position.shown}",
        f"{sweep.main_gain}_ratio",
    ]
    units = {"°": "deg", "°C": "degC", "1/s": ""}  # a number per second says so by its name
    merits = [f"{name}_{units.get(unit, unit)}".rstrip("_") for name, (_, unit, _) in shown_in(position).items()]
    outputs = np.stack([merit_values(sweep.merits, name, position).ravel() for name in SHOWN], axis=1)
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    least, own = (np.broadcast_to(one.grid[..., None], grid.shape).ravel() for one in (sweep.least, sweep.own_least))
    writer.writerow([*columns, *merits, "failed_at_s", "least_time_s", "least_time_own_limit_s"])
    for before, after, *rest in zip(inputs, outputs, sweep.failed_at.ravel(), least, own, strict=True):
        writer.writerow([f"{cell:.6g}" if np.isfinite(cell) else "" for cell in (*before, *after, *rest)])
    replace(path, text.getvalue())
