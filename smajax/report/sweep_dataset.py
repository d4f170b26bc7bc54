"""A sweep as a data set with named axes and units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from smajax.control.figures_of_merit import MERIT_UNITS
from smajax.control.sweep import Grid
from smajax.core.provenance import made_with
from smajax.report.sweep_page import Swept


def as_dataset(grid: Grid, swept: Sequence[Swept], between: str, command: str) -> xr.Dataset:
    """Figures of merit of every closed loop, SI, (controller, each mismatch, set point, share of the gain).

    Times are infinite where a run never gets there; `failed_at` is NaN where none failed.
    """
    ratios = [f"{name}_ratio" for name in grid.mismatches]
    dims = ("controller", *ratios, "set_point", "gain_ratio")
    shape = (len(swept), *(len(grid.ratios) for _ in ratios), *grid.shape[2:])

    def all_of(several: Sequence[np.ndarray]) -> np.ndarray:
        return np.stack(several).reshape(shape)

    found = {
        name: (dims, all_of([np.asarray(getattr(one.merits, name)) for one in swept]), {"units": unit})
        for name, unit in MERIT_UNITS.items()
    }
    failed = all_of([one.failed_at for one in swept])
    found["failed_at"] = (dims, np.where(np.isfinite(failed), failed, np.nan), {"units": "s"})
    believed = {"units": "1", "long_name": "plant over what the controller believes"}
    axes = {
        "controller": [one.name for one in swept],
        **{name: (name, grid.ratios, believed) for name in ratios},
        "set_point": ("set_point", grid.targets, {"units": "rad"}),
        "gain_ratio": ("gain_ratio", grid.gains, {"units": "1", "long_name": "share of the controller's main gain"}),
    }
    gains = "; ".join(f"{one.name}: {one.main_gain}" for one in swept)
    told = {"command": command, "between": between, "main gains": gains, **made_with()}
    return xr.Dataset(found, axes, {name: str(value) for name, value in told.items()})
