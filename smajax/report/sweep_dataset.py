"""A sweep as a data set with named axes and units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from smajax.control.figures_of_merit import merit_units
from smajax.control.sweep.run_sweep import SweepResults
from smajax.core.files import json_line
from smajax.core.provenance import made_with


def as_dataset(results: SweepResults, command: str) -> xr.Dataset:
    """Figures of merit of every closed loop, SI, (controller, each mismatch, set point, ratio of the main gain).

    Times are infinite where a run never arrives or settles; `failed_at` is NaN where no loop failed. Least times, which the gain does not change, are
    infinite where the plant does not reach the set point with the largest command (of all controllers, of its own), and NaN where that has no limit.
    Of a batch the values of its plants' parameters are coordinates along `plant`.
    """
    sweeps, grid = results.sweeps, results.grid
    ratios = grid.axis_names
    dims = ("controller", *ratios, "set_point", "gain_ratio")
    shape = (len(sweeps), *(len(grid.ratios) for _ in ratios), *grid.shape[2:])

    def stacked(several: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack(several).reshape(shape)

    variables = {
        name: (dims, stacked([np.asarray(getattr(one.merits, name)) for one in sweeps]), {"units": unit})
        for name, unit in merit_units(results.unit.own).items()
    }
    failed = stacked([one.failed_at for one in sweeps])
    variables["failed_at"] = (dims, np.where(np.isfinite(failed), failed, np.nan), {"units": "s"})
    assumed = {"units": "1", "long_name": "plant over the value that the controller assumes"}
    if grid.numbered:
        assumed["long_name"] = "number of the plant in its batch"
    axes: dict[str, Any] = {
        "controller": [one.name for one in sweeps],
        **{name: (name, grid.ratios, assumed) for name in ratios},
        "set_point": ("set_point", grid.targets, {"units": results.unit.own}),
        "gain_ratio": ("gain_ratio", grid.gains, {"units": "1", "long_name": "ratio to the controller's main gain"}),
    }
    if grid.plants.batch is not None:
        for name, values, unit in zip(grid.plants.columns, grid.plants.batch.T, grid.plants.units, strict=True):
            axes[name] = (grid.axis_names[0], values, {"units": unit, "long_name": "of the plant"})
    for name, least in (
        ("least_time", [one.least for one in sweeps]),
        ("least_time_own_limit", [one.own_least for one in sweeps]),
    ):
        variables[name] = (dims[:-1], np.stack([one.grid for one in least]).reshape(shape[:-1]), {"units": "s"})
    gains = "; ".join(f"{one.name}: {one.main_gain}" for one in sweeps)
    attributes = {"command": command, "between": results.settings.between, "main gains": gains, **made_with()}
    attributes["integration_error"] = json_line({one.name: one.integration_error for one in sweeps})
    return xr.Dataset(variables, axes, {name: str(value) for name, value in attributes.items()})
