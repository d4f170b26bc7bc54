"""A sweep as a data set with named axes and units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from smajax.made_with import made_with
from smajax.merit import MERIT_UNITS
from smajax.sweep import Grid
from smajax.sweep_report import Swept


def as_dataset(grid: Grid, swept: Sequence[Swept], between: str, command: str) -> xr.Dataset:
    """Figures of merit of every closed loop, SI, (controller, first mismatch, second, set point, share of the gain).

    Times are infinite where a run never gets there; `failed_at` is NaN where none failed.
    """
    dims = ("controller", f"{grid.first}_ratio", f"{grid.second}_ratio", "set_point", "gain_ratio")
    found = {
        name: (dims, np.stack([np.asarray(getattr(one.merits, name)) for one in swept]), {"units": unit})
        for name, unit in MERIT_UNITS.items()
    }
    failed = np.stack([one.failed_at for one in swept])
    found["failed_at"] = (dims, np.where(np.isfinite(failed), failed, np.nan), {"units": "s"})
    axes = {
        dims[0]: [one.name for one in swept],
        dims[1]: (dims[1], grid.ratios, {"units": "1", "long_name": "plant over what the controller believes"}),
        dims[2]: (dims[2], grid.ratios, {"units": "1", "long_name": "plant over what the controller believes"}),
        dims[3]: (dims[3], grid.targets, {"units": "rad"}),
        dims[4]: (dims[4], grid.gains, {"units": "1", "long_name": "share of the controller's main gain"}),
    }
    gains = "; ".join(f"{one.name}: {one.main_gain}" for one in swept)
    told = {"command": command, "between": between, "main gains": gains, **made_with()}
    return xr.Dataset(found, axes, {name: str(value) for name, value in told.items()})
